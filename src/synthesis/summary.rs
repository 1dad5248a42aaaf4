//! What there is to say of a sequence: as text and as JSON.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::{
    ControlWarning, Sequence, SequenceRequest, SynthesisOptions, ToesOnFloor, trajectory_error,
};
use crate::counted::counted;

/// The units of the numbers beside it, by their names.
pub(super) type Units = BTreeMap<&'static str, &'static str>;

/// The numbers of a generated sequence. Distances in cm, frames of the result.
#[derive(Debug, Serialize)]
pub struct Summary {
    model: String,
    frames: usize,
    fps: f64,
    keyframes: Vec<KeyframeSummary>,
    /// From the root trajectory asked for to the root of the result.
    trajectory_error: Distances,
    /// From predicted positions to those of the fitted rotations.
    rotation_fit_error: Distances,
    /// None without feet.
    feet: Option<FeetSummary>,
    /// The same after the feet were pinned; none where they were not.
    feet_pinned: Option<FeetSummary>,
    warnings: Vec<String>,
    units: Units,
}

#[derive(Debug, Serialize)]
struct KeyframeSummary {
    frame: usize,
    /// From the joints of the model's own last frame to the keyframe's, before it was bent onto it;
    /// none for the first keyframe.
    missed: Option<Distances>,
}

/// Toes within 3 cm of the floor, which is as low as the feet come where the keyframes are from.
#[derive(Debug, Clone, Copy, Serialize)]
struct FeetSummary {
    /// cm/frame; none where no toe is on the floor.
    foot_skate: Option<f64>,
    /// Of the lowest toe above the floor; below 0 it goes through it.
    lowest_toe: f64,
}

impl From<ToesOnFloor> for FeetSummary {
    fn from(ToesOnFloor { travel, lowest }: ToesOnFloor) -> Self {
        Self {
            foot_skate: travel.mean(),
            lowest_toe: lowest,
        }
    }
}

impl fmt::Display for FeetSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.foot_skate {
            Some(skate) => write!(f, "toes on the floor slide {skate:.2} cm/frame")?,
            None => write!(f, "no toe is on the floor")?,
        }
        match self.lowest_toe {
            // What would be printed as 0.0.
            lowest if lowest < -0.05 => write!(f, ", the lowest goes {:.1} cm into it", -lowest),
            _ => Ok(()),
        }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Distances {
    mean: f64,
    max: f64,
}

impl Summary {
    /// `model`: what to call the model.
    pub fn new(
        model: &str,
        request: &SequenceRequest,
        sequence: &Sequence,
        options: &SynthesisOptions,
        warnings: &[ControlWarning],
    ) -> Self {
        let missed = |frame: usize| {
            let miss = sequence.misses.iter().find(|miss| miss.time == frame)?;
            let (mean, max) = (miss.mean, miss.max);
            Some(Distances { mean, max })
        };
        let keyframes = sequence.keyframes.iter().map(|&frame| KeyframeSummary {
            frame,
            missed: missed(frame),
        });
        let (mean, max) = trajectory_error(request, sequence);
        let pinned = sequence.feet.filter(|_| options.foot_cleanup);
        Self {
            model: model.into(),
            frames: sequence.clip.poses.len(),
            fps: 1.0 / sequence.clip.frame_time,
            keyframes: keyframes.collect(),
            trajectory_error: Distances { mean, max },
            rotation_fit_error: Distances {
                mean: sequence.fit.mean,
                max: sequence.fit.max,
            },
            feet: sequence.feet.map(|feet| feet.before.into()),
            feet_pinned: pinned.map(|feet| feet.after.into()),
            warnings: warnings.iter().map(ToString::to_string).collect(),
            units: Units::from([
                ("fps", "frames/s"),
                ("missed", "cm"),
                ("trajectory_error", "cm"),
                ("rotation_fit_error", "cm"),
                ("foot_skate", "cm/frame"),
                ("lowest_toe", "cm"),
            ]),
        }
    }
}

impl Summary {
    /// The same in the frames of a file of another rate: when the keyframes are there, and its
    /// seconds a frame.
    #[must_use]
    pub fn at_frames(mut self, times: &[usize], frame_time: f64) -> Self {
        self.frames = times.last().map_or(0, |last| last + 1);
        self.fps = 1.0 / frame_time;
        for (keyframe, &frame) in self.keyframes.iter_mut().zip(times) {
            keyframe.frame = frame;
        }
        self
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.model)?;
        let frames = counted(self.frames, "frame");
        writeln!(f, "{frames} at {:.4} a second", self.fps)?;
        for keyframe in &self.keyframes {
            write!(f, "keyframe at frame {}", keyframe.frame)?;
            match keyframe.missed {
                // What would be printed as 0.0.
                Some(Distances { max, .. }) if max < 0.05 => writeln!(f, ": the model met it")?,
                Some(Distances { mean, max }) => writeln!(
                    f,
                    ": the model missed it by {mean:.1} cm in the mean, {max:.1} cm at most, and was bent onto it"
                )?,
                None => writeln!(f)?,
            }
        }
        let Distances { mean, max } = self.trajectory_error;
        writeln!(
            f,
            "the root is {mean:.1} cm from the trajectory asked for in the mean, {max:.1} cm at most"
        )?;
        let Distances { mean, max } = self.rotation_fit_error;
        writeln!(
            f,
            "rotations meet the predicted positions to {mean:.1} cm in the mean, {max:.1} cm at most"
        )?;
        match (self.feet, self.feet_pinned) {
            (None, _) => Ok(()),
            (Some(feet), None) => writeln!(f, "{feet}"),
            (Some(feet), Some(pinned)) => {
                writeln!(f, "{feet}")?;
                writeln!(f, "after the feet were pinned {pinned}")
            }
        }
    }
}

//! Which frames of the test clips are shown, and what a model makes of them.

use std::ops::Range;

use glam::DVec3;

use super::LENGTH;
use crate::counted::counted;
use crate::data::{BeatExtrema, Recording};
use crate::evaluation::music_dance::{SEED, key_frames, window_question};
use crate::models::generator::Request;
use crate::models::pu2022::{WindowFrame, pose_of};
use crate::models::{Generator, ModelError};
use crate::motion::facing::FacingJoints;
use crate::motion::placement::vector;
use crate::motion::{Clip, Pose};
use crate::music::Analysis;
use crate::report::figures::FigureRequest;
use crate::report::{DrawnBody, MotionRow, ReportError};

/// World positions of the joints, `[frames][joints]`, cm.
pub type Positions = Vec<Vec<DVec3>>;

/// Frames of a test clip with its music, and another clip that a second seed is from.
pub struct Stage<'d> {
    clip: &'d Clip,
    music: &'d Analysis,
    recording: &'d Recording,
    frames: Range<usize>,
    /// The next test clip by name, the first after the last: the second seed is its middle.
    next: &'d Clip,
    /// Which extrema of the joints' mean speed are the beats of a motion.
    pub motion_beats: BeatExtrema,
}

impl<'d> Stage<'d> {
    /// The clip and frame that were asked for, or else the first test clip by name from its
    /// beginning.
    ///
    /// # Errors
    /// No test clip is long enough, what was asked for is not there, a clip without music.
    pub fn new(asked: &FigureRequest<'d>) -> Result<Self, ReportError> {
        let refused = |reason| Err(ReportError::Refused(reason));
        let frames = asked.length.unwrap_or(LENGTH);
        if key_frames(frames).next().is_none() {
            return refused(format!(
                "--length {frames}: the seed has {SEED} frames, and the first key pose stands 45 \
                 later; give {} or more",
                SEED + 45
            ));
        }
        let test = asked.dataset.test.iter();
        let mut clips: Vec<&Recording> = test.filter(|it| it.frames() >= frames).collect();
        clips.sort_by(|a, b| a.name().cmp(b.name()));
        let names = || clips.iter().map(|it| it.name()).collect::<Vec<_>>();
        let shown = match asked.clip {
            Some(name) => clips.iter().position(|it| it.name() == name),
            None => (!clips.is_empty()).then_some(0),
        };
        let Some(shown) = shown else {
            return refused(match asked.clip.filter(|_| !clips.is_empty()) {
                Some(name) => format!(
                    "--clip {name} is not among the test clips with {frames} frames or more: {}",
                    names().join(", ")
                ),
                None => format!("no test clip has the {frames} frames that the figures show"),
            });
        };
        let recording = clips[shown];
        let last = recording.frames() - frames;
        let start = asked.start.unwrap_or(0);
        if start > last {
            return refused(format!(
                "--start {start}: {} has {}, so {frames} of them start at frame {last} at the \
                 latest",
                recording.name(),
                counted(recording.frames(), "frame")
            ));
        }
        let Some(music) = &recording.music else {
            return refused(format!(
                "{} has no music; set data.music = true",
                recording.name()
            ));
        };
        Ok(Self {
            clip: &recording.clip,
            music,
            recording,
            frames: start..start + frames,
            next: &clips[(shown + 1) % clips.len()].clip,
            motion_beats: asked.subject.config.data.motion_beats,
        })
    }

    pub fn frames(&self) -> usize {
        self.frames.len()
    }

    /// "NAME, frames 0 to 239".
    pub fn describe(&self) -> String {
        let Range { start, end } = self.frames;
        format!("{}, frames {start} to {}", self.clip.name, end - 1)
    }

    pub fn recorded(&self) -> Positions {
        let poses = &self.clip.poses[self.frames.clone()];
        self.clip.skeleton.world_positions(poses)
    }

    /// Onset strength of the music, dB; beyond its end the last one.
    pub fn onset(&self) -> Vec<f64> {
        let onset = &self.music.onset;
        let last = onset.len() - 1;
        let at = |frame: usize| f64::from(onset[frame.min(last)]);
        self.frames.clone().map(at).collect()
    }

    /// Beats of the music, counted from the first frame shown.
    pub fn beats(&self) -> Vec<usize> {
        let beats = self.music.beats.iter();
        let shown = beats.filter(|beat| self.frames.contains(beat));
        shown.map(|beat| beat - self.frames.start).collect()
    }

    /// What a model is asked: the seed, the key poses and the music of the frames.
    ///
    /// # Errors
    /// The model hears and there is no music.
    pub fn question(&self, model: &dyn Generator) -> Result<Request, ReportError> {
        Ok(window_question(
            model,
            self.recording,
            self.frames.clone(),
            0,
        )?)
    }

    /// Where the second seed is from.
    pub fn other_seed(&self) -> String {
        let first = middle(self.next);
        let last = first + SEED - 1;
        format!("{}, frames {first} to {last}", self.next.name)
    }

    /// The same question after the second seed, turned and moved so that it ends where the first
    /// one does, facing the same way; on the bones of the first.
    ///
    /// # Errors
    /// A skeleton without hips and arms that could be told by their names.
    pub fn with_other_seed(&self, request: &Request) -> Result<Request, ReportError> {
        let mut request = request.clone();
        let first = middle(self.next);
        let poses = &self.next.poses[first..first + SEED];
        let bones = request.given[SEED - 1].pose.clone();
        let from = frame_of(self.next, &poses[SEED - 1])?;
        let to = frame_of(self.clip, &bones)?;
        for (given, pose) in request.given.iter_mut().zip(poses) {
            given.pose = pose_of(&to.to_world(&from.numbers(pose)), &bones);
        }
        Ok(request)
    }

    /// What a model makes of a request.
    ///
    /// # Errors
    /// The model fails.
    pub fn answer(
        &self,
        model: &dyn Generator,
        request: &Request,
    ) -> Result<Positions, ReportError> {
        let motions = model.generate(std::slice::from_ref(request))?;
        let motion = motions
            .into_iter()
            .next()
            .ok_or_else(|| ReportError::Refused(format!("{} gave no motion", model.name())))?;
        motion.check(request)?;
        let frames = motion.positions.outer_iter();
        Ok(frames
            .map(|frame| frame.rows().into_iter().map(vector).collect())
            .collect())
    }

    /// A row of dancers, its key poses framed.
    pub fn row(&self, label: &str, positions: Positions, generated: bool) -> MotionRow {
        let body = DrawnBody::of(&self.clip.skeleton);
        MotionRow {
            keyframes: Vec::new(),
            seed: SEED,
            framed: key_frames(self.frames()).collect(),
            ..MotionRow::of_body(label, body, positions, generated)
        }
    }
}

/// Where the second seed begins in its clip.
fn middle(clip: &Clip) -> usize {
    (clip.poses.len() - SEED) / 2
}

fn frame_of(clip: &Clip, last: &Pose) -> Result<WindowFrame, ReportError> {
    let facing = FacingJoints::of(&clip.skeleton);
    let facing = facing.map_err(|missing| ModelError::data(&missing))?;
    Ok(WindowFrame::of(&clip.skeleton, &facing, last))
}

//! Which windows the figures show and measure, and what a model makes of them.

use glam::DVec3;
use ndarray::{Array2, ArrayView2, s};
use rayon::prelude::*;

use crate::counted::counted;
use crate::evaluation::equations::{WindowScores, window_scores};
use crate::models::transition::{DanceClip, check_frames, window_features};
use crate::models::{Generator, ModelError, Request};
use crate::motion::JOINTS;
use crate::motion::features::{FRAME, ROOT_POSITION};
use crate::motion::placement::{vector, world_positions};
use crate::report::figures::FigureRequest;
use crate::report::figures::Numbers;
use crate::report::{MotionRow, ReportError};
use crate::synthesis::{SequenceRequest, SynthesisError};

/// Windows that a model predicts in one call.
const CHUNK: usize = 8;

/// Frames from keyframe to keyframe, where none are asked for.
const LENGTH: usize = 100;

/// Transitions of test clips, one a clip: the first is shown, all are measured.
pub struct Stage<'d> {
    /// At least one.
    windows: Vec<ShownWindow<'d>>,
}

/// One transition of a clip.
pub struct ShownWindow<'d> {
    pub clip: &'d DanceClip,
    pub start: usize,
    /// `[N + 1, 154]`, not standardised.
    pub recorded: Array2<f64>,
    pub request: SequenceRequest,
}

/// What a model made of a window under some controls.
pub struct Generated {
    /// What it was asked for.
    pub request: SequenceRequest,
    /// Keyframe k1 and the N frames as predicted, `[N + 1, 149]`.
    pub frames: Array2<f64>,
}

impl<'d> Stage<'d> {
    /// The window of the asked length in the middle of every clip that is long enough, in the order
    /// of the names; before them that of the asked clip and start, if any.
    ///
    /// # Errors
    /// No clip is long enough; the chosen one is not there or has no such window.
    pub fn new(clips: &'d [DanceClip], asked: &FigureRequest<'_>) -> Result<Self, ReportError> {
        let FigureRequest {
            length,
            clip,
            start,
            ..
        } = *asked;
        let length = length.unwrap_or(LENGTH);
        let needed = length + 1;
        let fitting = clips.iter().filter(|clip| clip.frames() >= needed);
        let mut fitting: Vec<&DanceClip> = fitting.collect();
        fitting.sort_by(|a, b| a.name.cmp(&b.name));
        let mut first = 0;
        if let Some(name) = clip {
            let found = fitting.iter().position(|clip| clip.name == name);
            first = found.ok_or_else(|| {
                let names: Vec<&str> = fitting.iter().map(|clip| clip.name.as_str()).collect();
                ReportError::Refused(format!(
                    "--clip {name} is not among the test clips with {needed} frames or more: {}",
                    names.join(", ")
                ))
            })?;
        }
        if fitting.is_empty() {
            let longest = clips.iter().map(DanceClip::frames).max().unwrap_or(0);
            return Err(ReportError::Refused(format!(
                "no test clip has the {needed} frames of --length {length} (the longest has {longest})"
            )));
        }
        fitting[..=first].rotate_right(1);
        let mut windows = Vec::with_capacity(fitting.len());
        for (index, clip) in fitting.into_iter().enumerate() {
            let last = clip.frames() - needed;
            let start = match start {
                Some(start) if index == 0 => start,
                _ => last / 2,
            };
            if start > last {
                return Err(ReportError::Refused(format!(
                    "--start {start}: {} has {}, so a window of {needed} starts at frame \
                     {last} at the latest",
                    clip.name,
                    counted(clip.frames(), "frame")
                )));
            }
            windows.push(ShownWindow {
                clip,
                start,
                recorded: window_features(&clip.features, start, length),
                request: SequenceRequest::from_clip(clip, &[start, start + length])?,
            });
        }
        Ok(Self { windows })
    }

    /// The window that the figures show.
    pub fn shown(&self) -> &ShownWindow<'d> {
        &self.windows[0]
    }

    /// All windows, the shown one first.
    pub fn windows(&self) -> &[ShownWindow<'d>] {
        &self.windows
    }

    /// What the means in captions are over.
    pub fn measured_on(&self) -> String {
        match self.windows.len() {
            1 => "on this transition".into(),
            count => format!("in the mean of {count} test transitions"),
        }
    }

    /// Notes how many windows the means are over.
    pub fn count(&self, numbers: &mut Numbers) {
        let windows = self.windows.len() as f64;
        numbers.add("all windows", "windows", windows, "");
    }

    /// A figure's title: what it is about, by which model, on which window.
    pub fn title(&self, what: &str, model: &str) -> String {
        format!("{what}: {model} on {}", self.shown().describe())
    }

    /// What the model makes of every window under the controls that `change` sets, as it predicts
    /// it: nothing is blended or cleaned up.
    ///
    /// # Errors
    /// A control does not fit, or the model fails.
    pub fn generate(
        &self,
        model: &dyn Generator,
        change: impl Fn(SequenceRequest) -> Result<SequenceRequest, SynthesisError>,
    ) -> Result<Vec<Generated>, ReportError> {
        let changed = self.windows.iter().map(|it| change(it.request.clone()));
        let requests: Vec<SequenceRequest> = changed.collect::<Result<_, _>>()?;
        let pieces = requests.iter().map(|it| it.piece(&it.keyframes));
        let predicted: Vec<Vec<Array2<f64>>> = pieces
            .collect::<Vec<Request>>()
            .par_chunks(CHUNK)
            .map(|chunk| model.raw(chunk))
            .collect::<Result<_, ModelError>>()?;
        let predicted = predicted.into_iter().flatten();
        let generated = requests.into_iter().zip(predicted);
        let generated = generated.map(|(request, predicted)| {
            check_frames(predicted.view(), request.frames() - 1)?;
            let mut frames = Array2::zeros((request.frames(), FRAME));
            let first = request.keyframes[0].keyframe.features.slice(s![..FRAME]);
            frames.row_mut(0).assign(&first);
            frames.slice_mut(s![1.., ..]).assign(&predicted);
            Ok(Generated { request, frames })
        });
        generated.collect()
    }

    /// Scores of what a model made of every window.
    ///
    /// # Errors
    /// Predictions that do not fit.
    pub fn scores(
        &self,
        model: &str,
        generated: &[Generated],
    ) -> Result<Vec<WindowScores>, ReportError> {
        let pairs = self.windows.iter().zip(generated);
        let scores = pairs.map(|(window, it)| {
            window_scores(window.recorded.view(), it.frames.slice(s![1.., ..]))
        });
        let scores: Result<_, _> = scores.collect();
        scores.map_err(|source| ReportError::Scores {
            model: model.into(),
            source,
        })
    }
}

impl ShownWindow<'_> {
    /// "NAME, frames 120 to 220 (N = 100)".
    pub fn describe(&self) -> String {
        let length = self.recorded.nrows() - 1;
        let (clip, start, end) = (&self.clip.name, self.start, self.start + length);
        format!("{clip}, frames {start} to {end} (N = {length})")
    }
}

impl Generated {
    /// World positions of the joints with the last frame as the keyframe that was given, `[N +
    /// 1][24]`, cm.
    fn drawn(&self) -> Vec<[DVec3; JOINTS]> {
        let mut drawn = positions(self.frames.view());
        if let (Some(last), Some(target)) = (drawn.last_mut(), self.request.keyframes.last()) {
            *last = world_positions(target.keyframe.features.view());
        }
        drawn
    }

    /// A row of dancers from keyframe to keyframe.
    pub fn row(&self, label: &str) -> MotionRow {
        MotionRow::between_keyframes(label, self.drawn(), true)
    }

    /// Root positions that were asked for, cm.
    pub fn target(&self) -> Vec<DVec3> {
        points(self.request.root_trajectory.view())
    }

    /// Root positions as predicted, cm.
    pub fn roots(&self) -> Vec<DVec3> {
        points(self.frames.slice(s![.., ROOT_POSITION]))
    }
}

/// World positions of the joints of every frame, cm.
pub fn positions(frames: ArrayView2<f64>) -> Vec<[DVec3; JOINTS]> {
    frames.rows().into_iter().map(world_positions).collect()
}

fn points(rows: ArrayView2<f64>) -> Vec<DVec3> {
    rows.rows().into_iter().map(vector).collect()
}

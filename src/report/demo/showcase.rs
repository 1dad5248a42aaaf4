//! One transition of a test clip: as a BVH file, and beside interpolation and the recorded motion
//! as a figure and in the viewer.

use std::fmt;
use std::path::PathBuf;

use ndarray::{Array2, s};

use super::DemoError;
use crate::evaluation::equations::window_request;
use crate::models::transition::DanceClip;
use crate::models::transition::window_features;
use crate::models::transition::{Transition, TransitionRequest};
use crate::models::{Generator, Request};
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::motion::features::FRAME;
use crate::motion::placement::world_positions;
use crate::report::{
    Asked, FigureError, MotionFigure, MotionKind, MotionRow, Placing, Shown, Viewer,
    ViewerKeyframe, ViewerMotion,
};
use crate::run::replace_file;
use crate::synthesis::{SynthesisedMotion, transition_motion};

/// N of the transition that is shown, frames.
const LENGTH: usize = 100;
/// Frames from one dancer of the figure to the next.
const EVERY: usize = 10;

/// The transition in the middle of the first test clip; its `Display` says which.
pub struct Showcase<'d> {
    clip: &'d DanceClip,
    start: usize,
    /// `[N + 1, 154]`, not standardised.
    recorded: Array2<f64>,
    request: Request,
}

impl<'d> Showcase<'d> {
    /// # Errors
    /// No clip is long enough.
    pub fn new(clips: &'d [DanceClip]) -> Result<Self, DemoError> {
        let clip = clips
            .iter()
            .find(|clip| clip.frames() > LENGTH)
            .ok_or(DemoError::TooShort { length: LENGTH })?;
        let start = (clip.frames() - LENGTH - 1) / 2;
        let recorded = window_features(&clip.features, start, LENGTH);
        let request =
            window_request(&clip.clip, start, recorded.view()).ok_or_else(|| DemoError::Poses {
                clip: clip.name.clone(),
            })?;
        Ok(Self {
            clip,
            start,
            recorded,
            request,
        })
    }

    /// Writes the model's transition as BVH, the figure and the viewer's page.
    ///
    /// # Errors
    /// A model fails, or a file cannot be written.
    pub fn write(
        &self,
        interpolation: &dyn Generator,
        model: &dyn Generator,
        files: &ShowcaseFiles,
    ) -> Result<SynthesisedMotion, DemoError> {
        let predicted = self.predict(model)?;
        let motions = [
            ("Ground truth", MotionKind::Recorded, self.recorded.clone()),
            (
                "Interpolation",
                MotionKind::Other,
                self.shown(&self.predict(interpolation)?),
            ),
            (
                "Small whole model",
                MotionKind::Model,
                self.shown(&predicted),
            ),
        ];
        replace_file(&files.figure, self.figure(&motions)?.as_bytes())?;
        replace_file(&files.viewer, self.viewer(&motions)?.as_bytes())?;
        let name = files.bvh.display().to_string();
        let request = TransitionRequest::of(&self.request)?;
        let motion = transition_motion(&request, &predicted, &name, self.clip.clip.frame_time)?;
        let channels = channel_layout(&motion.clip, [Axis::Z, Axis::X, Axis::Y]);
        bvh::write(&files.bvh, &Bvh::from_clip(&motion.clip, channels)?)?;
        Ok(motion)
    }

    fn predict(&self, model: &dyn Generator) -> Result<Transition, DemoError> {
        let mut predicted = model.raw(std::slice::from_ref(&self.request))?;
        let frames = predicted.pop().ok_or_else(|| DemoError::NoTransition {
            model: model.name().into(),
        })?;
        Ok(Transition { frames })
    }

    /// A prediction between the two keyframes as they were given, `[N + 1, 149]`.
    fn shown(&self, transition: &Transition) -> Array2<f64> {
        let mut frames = self.recorded.slice(s![.., ..FRAME]).to_owned();
        let between = transition.frames.slice(s![..LENGTH - 1, ..]);
        frames.slice_mut(s![1..LENGTH, ..]).assign(&between);
        frames
    }

    /// The motions in rows.
    fn figure(&self, motions: &[Named]) -> Result<String, FigureError> {
        let rows = motions.iter().map(|(label, kind, frames)| {
            let frames = frames.rows().into_iter().map(world_positions).collect();
            MotionRow::between_keyframes(*label, frames, *kind != MotionKind::Recorded)
        });
        let figure = MotionFigure {
            title: format!("{self}"),
            caption: String::new(),
            rows: rows.collect(),
            shown: Shown::Every(EVERY),
            placing: Placing::OnFirstPath,
        };
        figure.svg()
    }

    /// The motions in the viewer.
    fn viewer(&self, motions: &[Named]) -> Result<String, FigureError> {
        let motions = motions
            .iter()
            .map(|(name, kind, frames)| ViewerMotion::from_features(*name, *kind, frames.view()));
        let keyframes = [0, LENGTH].map(|frame| ViewerKeyframe {
            frame,
            positions: world_positions(self.recorded.row(frame)),
        });
        let viewer = Viewer {
            title: format!("{self}"),
            frame_time: self.clip.clip.frame_time,
            motions: motions.collect(),
            keyframes: keyframes.to_vec(),
            asked: self
                .request
                .root
                .as_ref()
                .zip(self.request.velocity_factors.as_ref())
                .map(|(root, factors)| Asked::new(root.view(), factors.view())),
        };
        viewer.html()
    }
}

/// What a motion is called, where it comes from, its frames `[N + 1, 149 or 154]`.
type Named = (&'static str, MotionKind, Array2<f64>);

/// Where the showcase goes.
pub struct ShowcaseFiles {
    pub figure: PathBuf,
    pub viewer: PathBuf,
    pub bvh: PathBuf,
}

impl fmt::Display for Showcase<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}, frames {} to {} (N = {LENGTH})",
            self.clip.name,
            self.start,
            self.start + LENGTH
        )
    }
}

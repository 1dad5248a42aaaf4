//! One transition of a test clip: as a BVH file, and beside interpolation and the recorded motion
//! as a figure and in the viewer.

use std::fmt;
use std::path::Path;

use ndarray::{Array2, s};

use super::{FIGURE, TRANSITION, VIEWER};
use crate::evaluation::transitions::window_request;
use crate::models::transition::{DanceClip, Transition, TransitionRequest, window_features};
use crate::models::{Generator, Request};
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::motion::features::FRAME;
use crate::motion::placement::world_positions;
use crate::report::{
    Asked, FigureError, MotionFigure, MotionKind, MotionRow, Placing, ReportError, Shown, Viewer,
    ViewerBody, ViewerKeyframe, ViewerMotion,
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
    pub fn new(clips: &'d [DanceClip]) -> Result<Self, ReportError> {
        let short = || format!("no test clip has the frames of a transition of {LENGTH}");
        let clip = clips.iter().find(|clip| clip.frames() > LENGTH);
        let clip = clip.ok_or_else(|| ReportError::Refused(short()))?;
        let start = (clip.frames() - LENGTH - 1) / 2;
        let recorded = window_features(&clip.features, start, LENGTH);
        let request = window_request(&clip.clip, start, recorded.view());
        let fewer = || format!("{} has fewer poses than frames", clip.name);
        let request = request.ok_or_else(|| ReportError::Refused(fewer()))?;
        Ok(Self {
            clip,
            start,
            recorded,
            request,
        })
    }

    /// Writes the model's transition as BVH, the figure and the viewer's page into a folder.
    ///
    /// # Errors
    /// A model fails, or a file cannot be written.
    pub fn write(
        &self,
        interpolation: &dyn Generator,
        model: &dyn Generator,
        folder: &Path,
    ) -> Result<SynthesisedMotion, ReportError> {
        let predicted = self.predict(model)?;
        let interpolated = self.shown(&self.predict(interpolation)?);
        let motions = [
            ("Ground truth", MotionKind::Recorded, self.recorded.clone()),
            ("Interpolation", MotionKind::Other, interpolated),
            (
                "Small whole model",
                MotionKind::Model,
                self.shown(&predicted),
            ),
        ];
        replace_file(&folder.join(FIGURE), self.figure(&motions)?)?;
        replace_file(&folder.join(VIEWER), self.viewer(&motions)?)?;
        let file = folder.join(TRANSITION);
        let name = file.display().to_string();
        let request = TransitionRequest::of(&self.request)?;
        let motion = transition_motion(&request, &predicted, &name, self.clip.clip.frame_time)?;
        let channels = channel_layout(&motion.clip, [Axis::Z, Axis::X, Axis::Y]);
        bvh::write(&file, &Bvh::from_clip(&motion.clip, channels)?)?;
        Ok(motion)
    }

    fn predict(&self, model: &dyn Generator) -> Result<Transition, ReportError> {
        let mut predicted = model.raw(std::slice::from_ref(&self.request))?;
        let frames = predicted
            .pop()
            .ok_or_else(|| ReportError::Refused(format!("{} gave no transition", model.name())))?;
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
        MotionFigure {
            title: self.to_string(),
            caption: String::new(),
            rows: rows.collect(),
            shown: Shown::Every(EVERY),
            placing: Placing::OnFirstPath,
            music: None,
        }
        .svg()
    }

    /// The motions in the viewer.
    fn viewer(&self, motions: &[Named]) -> Result<String, FigureError> {
        let motions = motions
            .iter()
            .map(|(name, kind, frames)| ViewerMotion::from_features(*name, *kind, frames.view()));
        let keyframes = [0, LENGTH].map(|frame| ViewerKeyframe {
            frame,
            positions: world_positions(self.recorded.row(frame)).to_vec(),
        });
        let (root, factors) = (&self.request.root, &self.request.velocity_factors);
        let asked = root.as_ref().zip(factors.as_ref());
        Viewer {
            title: self.to_string(),
            frame_time: self.clip.clip.frame_time,
            body: ViewerBody::dance(),
            motions: motions.collect(),
            keyframes: keyframes.to_vec(),
            asked: asked.map(|(root, factors)| Asked::new(root.view(), factors.view())),
            music: None,
            picks: None,
        }
        .html()
    }
}

/// What a motion is called, where it comes from, its frames `[N + 1, 149 or 154]`.
type Named = (&'static str, MotionKind, Array2<f64>);

impl fmt::Display for Showcase<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (clip, start, end) = (&self.clip.name, self.start, self.start + LENGTH);
        write!(f, "{clip}, frames {start} to {end} (N = {LENGTH})")
    }
}

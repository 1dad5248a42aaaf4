//! One transition of a test clip: as a BVH file, and beside interpolation and the recorded motion.

use std::fmt;
use std::path::Path;

use anyhow::Context as _;
use ndarray::Array2;

use crate::data::{DanceClip, window_features};
use crate::evaluation::window_request;
use crate::models::{Transition, TransitionModel, TransitionRequest};
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::motion::placement::world_positions;
use crate::report::{MotionFigure, MotionRow};
use crate::synthesis::{SynthesisedMotion, transition_motion};
use crate::training::replace_file;

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
    request: TransitionRequest,
}

impl<'d> Showcase<'d> {
    /// # Errors
    /// No clip is long enough.
    pub fn new(clips: &'d [DanceClip]) -> anyhow::Result<Self> {
        let clip = clips
            .iter()
            .find(|clip| clip.frames() > LENGTH)
            .with_context(|| format!("no test clip has the frames of a transition of {LENGTH}"))?;
        let start = (clip.frames() - LENGTH - 1) / 2;
        let recorded = window_features(&clip.features, start, LENGTH);
        let request = window_request(&clip.clip, start, recorded.view())
            .with_context(|| format!("{} has fewer poses than frames", clip.name))?;
        Ok(Self {
            clip,
            start,
            recorded,
            request,
        })
    }

    /// Writes the model's transition as BVH, and the figure.
    ///
    /// # Errors
    /// A model fails, or a file cannot be written.
    pub fn write(
        &self,
        interpolation: &dyn TransitionModel,
        model: &dyn TransitionModel,
        figure: &Path,
        bvh: &Path,
    ) -> anyhow::Result<SynthesisedMotion> {
        let predicted = self.predict(model)?;
        let svg = self.figure(&self.predict(interpolation)?, &predicted)?;
        replace_file(figure, svg.as_bytes())?;
        let name = bvh.display().to_string();
        let motion =
            transition_motion(&self.request, &predicted, &name, self.clip.clip.frame_time)?;
        let channels = channel_layout(&motion.clip, [Axis::Z, Axis::X, Axis::Y]);
        bvh::write(bvh, &Bvh::from_clip(&motion.clip, channels)?)?;
        Ok(motion)
    }

    fn predict(&self, model: &dyn TransitionModel) -> anyhow::Result<Transition> {
        let mut transitions = model.transitions(std::slice::from_ref(&self.request))?;
        transitions
            .pop()
            .with_context(|| format!("{} gave no transition", model.name()))
    }

    /// Recorded, interpolated and predicted motion in rows; both keyframes in each as they were given.
    fn figure(&self, interpolated: &Transition, predicted: &Transition) -> anyhow::Result<String> {
        let recorded: Vec<_> = self
            .recorded
            .rows()
            .into_iter()
            .map(world_positions)
            .collect();
        let row = |label: &str, transition: &Transition| {
            let mut frames = recorded.clone();
            let between = transition.frames.rows().into_iter().take(LENGTH - 1);
            for (frame, positions) in frames[1..].iter_mut().zip(between) {
                *frame = world_positions(positions);
            }
            MotionRow {
                label: label.into(),
                frames,
                generated: true,
            }
        };
        let truth = MotionRow {
            label: "Ground truth".into(),
            frames: recorded.clone(),
            generated: false,
        };
        let figure = MotionFigure {
            title: format!("{self}"),
            rows: vec![
                truth,
                row("Interpolation", interpolated),
                row("Small whole model", predicted),
            ],
            keyframes: vec![0, LENGTH],
            every: EVERY,
        };
        Ok(figure.svg()?)
    }
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

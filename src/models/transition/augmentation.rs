//! In which form a window is trained: as recorded, in the mirror, or either at another tempo.

use rand::RngExt as _;

use super::Window;
use super::task::StepPlan;
use crate::models::forms::Form;
use crate::models::{AugmentationConfig, Streams};

/// The forms in which clips are trained, one after the other: all as recorded, in the mirror where
/// those are trained, then the same at each tempo.
pub(super) struct Augmentation {
    /// Recorded clips.
    recorded: usize,
    config: AugmentationConfig,
}

impl Augmentation {
    /// Forms of so many clips.
    pub fn new(recorded: usize, config: &AugmentationConfig) -> Self {
        Self {
            recorded,
            config: config.clone(),
        }
    }

    /// All forms in their order.
    pub fn forms(&self) -> Vec<Form> {
        self.config.forms()
    }

    fn sides(&self) -> usize {
        1 + usize::from(self.config.mirror)
    }

    /// How many of the clips in all forms, from the first on, are at the recorded tempo.
    pub fn at_recorded_tempo(&self) -> usize {
        self.recorded * self.sides()
    }

    /// Draws in which of its clip's forms each window of a step is seen; those of `plan` are of
    /// recorded clips, `frames` are those of the clips in all forms.
    pub fn vary(&self, plan: &mut StepPlan, frames: &[usize], streams: &Streams, step: u64) {
        let length = plan.length;
        let windows = plan.windows.iter_mut().map(|window| (window, length));
        let single_frames = plan.single_frames.iter_mut();
        let single_frames = single_frames.map(|plan| (&mut plan.window, plan.length));
        let (mut tempi, mut sides) = (
            streams.stream("tempi", &[step]),
            streams.stream("mirroring", &[step]),
        );
        for (window, length) in windows.chain(single_frames) {
            if !self.config.tempi.is_empty() {
                let tempo = tempi.random_range(0..=self.config.tempi.len());
                *window = self.at_tempo(*window, length, tempo, frames);
            }
            if self.config.mirror && sides.random() {
                window.clip += self.recorded;
            }
        }
    }

    /// The window of `length` + 1 frames at about the same place of its clip at the tempo of this
    /// number, 0 for the recorded one.
    fn at_tempo(&self, window: Window, length: usize, tempo: usize, frames: &[usize]) -> Window {
        let clip = window.clip + self.at_recorded_tempo() * tempo;
        let [recorded, frames] = [window.clip, clip].map(|clip| frames[clip]);
        match frames.checked_sub(length + 1) {
            Some(last) => Window {
                clip,
                start: (window.start * frames / recorded).min(last),
            },
            None => window,
        }
    }
}

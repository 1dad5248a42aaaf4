//! Scores on validation clips while a training goes on: how much more the budget would buy.

use serde::{Deserialize, Serialize};

use super::TrainingError;
use crate::data::{DanceClip, Dataset};
use crate::evaluation::{Evaluation, EvaluationError, Protocol};
use crate::models::transition::TransitionModel;

/// When a training scores itself on the clips that `data.validation_share` sets aside, and on how many windows.
///
/// Scoring draws no random number and moves no weight: a training is the same to the bit with it and without.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValidationConfig {
    /// Steps from one scoring to the next; the last step is always scored.
    pub every_steps: u64,
    /// Windows of each length, the same each time, spread evenly over the validation clips.
    pub windows: usize,
    /// Transition lengths N, frames.
    pub lengths: Vec<usize>,
}

impl Default for ValidationConfig {
    fn default() -> Self {
        let Protocol { lengths, .. } = Protocol::default();
        Self {
            every_steps: 500,
            windows: 32,
            lengths,
        }
    }
}

impl ValidationConfig {
    /// Refuses what could not be scored, before anything is trained.
    ///
    /// # Errors
    /// No validation clips, or none with more frames than a length.
    pub(crate) fn check(&self, dataset: &Dataset) -> Result<(), TrainingError> {
        let frames = dataset.validation.iter().map(DanceClip::frames);
        let longest = frames.max().ok_or(TrainingError::NoValidationClips)?;
        match self.lengths.iter().find(|&&length| length >= longest) {
            Some(&length) => Err(TrainingError::ValidationLength { length, longest }),
            None => Ok(()),
        }
    }

    /// Scores a model.
    ///
    /// # Errors
    /// No validation clip is long enough for a length, or the model fails.
    pub(crate) fn score(
        &self,
        model: &dyn TransitionModel,
        dataset: &Dataset,
    ) -> Result<Evaluation, EvaluationError> {
        let protocol = Protocol {
            lengths: self.lengths.clone(),
            most_windows: Some(self.windows),
            ..Protocol::default()
        };
        Ok(protocol.evaluate(model, &dataset.validation)?.evaluation)
    }
}

//! Scores on validation clips while a training goes on: how much more the budget would buy.

use serde::{Deserialize, Serialize};

use crate::data::Dataset;
use crate::evaluation::{Evaluation, EvaluationError, Protocol};
use crate::models::TransitionModel;

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
    /// Scores a model.
    ///
    /// # Errors
    /// No validation clip is long enough for a length, or the model fails.
    pub(super) fn score(
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

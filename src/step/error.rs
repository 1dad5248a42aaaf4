//! What can end a step.

use thiserror::Error;

use crate::models::ModelError;
use crate::optim::SettingError;
use crate::ranks::RanksError;

/// Why a step cannot be done.
#[derive(Debug, Error)]
pub enum StepError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Ranks(#[from] RanksError),
    /// What is asked for cannot be computed: what, and what to do.
    #[error("{0}")]
    Refused(String),
    /// The training diverged, at this step or, where its cause are the weights, in the update that
    /// ended it.
    #[error(
        "step {step} ({what}) is not finite: {cause}; the last checkpoint is as it was; \
         try a lower optimiser.learning_rate or optimiser.clip_norm=1.0"
    )]
    NonFinite {
        /// Counted from 1.
        step: u64,
        /// What the step trains.
        what: String,
        /// Operation and shapes.
        cause: String,
    },
}

impl From<SettingError> for StepError {
    fn from(error: SettingError) -> Self {
        Self::Refused(format!("optimiser.{error}"))
    }
}

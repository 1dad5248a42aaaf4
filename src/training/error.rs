//! What can end a training before its end.

use thiserror::Error;

use crate::data::EmptyPart;
use crate::models::ModelError;
use crate::optim::SettingError;
use crate::ranks::RanksError;
use crate::run::{FileError, RunError};
use crate::step::StepError;

/// Why a training cannot begin, go on or be saved.
#[derive(Debug, Error)]
pub enum TrainingError {
    #[error(transparent)]
    Run(#[from] RunError),
    /// A step is not to be had, or diverged: [`StepError::NonFinite`].
    #[error(transparent)]
    Step(#[from] StepError),
    /// What is asked for cannot be trained: what, and what to do.
    #[error("{0}")]
    Refused(String),
    #[error(
        "validation.every_steps needs validation clips; set some aside with data.validation_share, \
         such as 0.1, or leave [validation] out"
    )]
    NoValidationClips(#[from] EmptyPart),
}

impl TrainingError {
    /// Whether a loss, a gradient or a weight was not finite.
    pub fn is_divergence(&self) -> bool {
        matches!(self, Self::Step(StepError::NonFinite { .. }))
    }
}

impl From<ModelError> for TrainingError {
    fn from(error: ModelError) -> Self {
        StepError::from(error).into()
    }
}

impl From<RanksError> for TrainingError {
    fn from(error: RanksError) -> Self {
        StepError::from(error).into()
    }
}

impl From<SettingError> for TrainingError {
    fn from(error: SettingError) -> Self {
        StepError::from(error).into()
    }
}

impl From<FileError> for TrainingError {
    fn from(error: FileError) -> Self {
        Self::Run(error.into())
    }
}

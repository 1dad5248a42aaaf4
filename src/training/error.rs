//! What can end a training before its end.

use thiserror::Error;

use crate::data::EmptyPart;
use crate::models::ModelError;
use crate::optim::SettingError;
use crate::ranks::RanksError;
use crate::run::{FileError, RunError};

/// Why a training cannot begin, go on or be saved.
#[derive(Debug, Error)]
pub enum TrainingError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Ranks(#[from] RanksError),
    /// What is asked for cannot be trained: what, and what to do.
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
    #[error(
        "validation.every_steps needs validation clips; set some aside with data.validation_share, \
         such as 0.1, or leave [validation] out"
    )]
    NoValidationClips(#[from] EmptyPart),
}

impl From<SettingError> for TrainingError {
    fn from(error: SettingError) -> Self {
        Self::Refused(format!("optimiser.{error}"))
    }
}

impl From<FileError> for TrainingError {
    fn from(error: FileError) -> Self {
        Self::Run(error.into())
    }
}

//! Why a run's folder cannot be read, gone on with or written.

use thiserror::Error;

use super::durable::FileError;
use crate::experiment::ConfigError;
use crate::models::ModelError;
use crate::models::settings::LoadError;
use crate::models::weights::WeightsError;

/// Why a run cannot be used.
#[derive(Debug, Error)]
pub enum RunError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Weights(#[from] WeightsError),
    #[error("the training state cannot be written")]
    State(#[from] bincode::error::EncodeError),
    /// What lies in the folder is damaged, or does not go with what is asked of it: what, and what
    /// to do.
    #[error("{0}")]
    Refused(String),
}

impl From<LoadError> for RunError {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Model(error) => error.into(),
            LoadError::Weights(error) => error.into(),
        }
    }
}

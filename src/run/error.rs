//! Why a run's folder cannot be read, gone on with or written.

use std::path::PathBuf;

use thiserror::Error;

use super::checkpoint::CheckpointError;
use super::durable::FileError;
use super::state::StateError;
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
    #[error(transparent)]
    State(#[from] StateError),
    #[error("{path}, line {line}, is no line of a training's log: {cause}")]
    Log {
        path: PathBuf,
        line: usize,
        cause: serde_json::Error,
    },
    #[error("{path} holds a run already; go on with --resume, or give another --out")]
    RunExists { path: PathBuf },
    #[error(
        "another training writes to {path} at this moment; wait for its end or stop it, or give another --out"
    )]
    Locked { path: PathBuf },
    /// What a run of another version of the program holds cannot be read or gone on with by this one.
    #[error("{path} was made by keydance {made_by}, this is {this}, which cannot use it: {cause}")]
    OtherVersion {
        path: PathBuf,
        made_by: String,
        this: String,
        cause: Box<RunError>,
    },
    #[error("{path} has format {found}, and this version of keydance knows formats up to {newest}")]
    ManifestFormat {
        path: PathBuf,
        found: u32,
        newest: u32,
    },
    #[error(
        "{path} holds a run with another config ({}); values there, values now; a run is resumed with the config and the --set \
         that it was started with",
        differences.join("; ")
    )]
    OtherConfig {
        path: PathBuf,
        differences: Vec<String>,
    },
    #[error(
        "{path} was trained on data with digest {saved}, the data folder now has digest {found}"
    )]
    OtherData {
        path: PathBuf,
        saved: String,
        found: String,
    },
    #[error("{path} belongs to a config with digest {saved}, the run's config has digest {found}")]
    OtherRun {
        path: PathBuf,
        saved: String,
        found: String,
    },
    #[error(
        "{path} holds no weights, neither of a finished training nor of a checkpoint; train it with `keydance train`"
    )]
    NoWeights { path: PathBuf },
    #[error(
        "{path} holds the weights of another model than the config describes ({}); values there, values of the config",
        differences.join("; ")
    )]
    OtherModel {
        path: PathBuf,
        differences: Vec<String>,
    },
    #[error("no checkpoint of {path} can be used: {}", problems.join("; "))]
    NoCheckpoint {
        path: PathBuf,
        problems: Vec<String>,
    },
    #[error("{path} is not a manifest: {cause}")]
    Manifest {
        path: PathBuf,
        cause: serde_json::Error,
    },
    #[error("{path} does not fit the model: {problem}")]
    Checkpoint {
        path: PathBuf,
        problem: CheckpointError,
    },
}

impl From<LoadError> for RunError {
    fn from(error: LoadError) -> Self {
        match error {
            LoadError::Model(error) => error.into(),
            LoadError::Weights(error) => error.into(),
        }
    }
}

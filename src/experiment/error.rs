//! What can end a reproduction before its end.

use std::path::PathBuf;

use super::ConfigError;
use crate::data::{DataError, EmptyPart};
use crate::evaluation::{EvaluationError, PrintedError, RecordError};
use crate::models::ModelError;
use crate::models::settings::ValueError;
use crate::report::FigureError;
use crate::run::{FileError, RunError};
use crate::training::TrainingError;

/// Why the rows of a table cannot be read, trained, evaluated or written.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    #[error("{folder} holds no config (.toml)")]
    NoConfig { folder: PathBuf },
    #[error("{file} is no row")]
    NoRow {
        file: PathBuf,
        source: Box<ConfigError>,
    },
    #[error("--seeds {name}")]
    Seeds { name: String, source: ValueError },
    /// What a row asks for cannot be trained.
    #[error("{row}")]
    Row {
        row: String,
        source: Box<TrainingError>,
    },
    /// What is asked for does not go together, or with what is there: what, and what to do.
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Data(#[from] DataError),
    #[error(transparent)]
    EmptyPart(#[from] EmptyPart),
    #[error(transparent)]
    Printed(#[from] PrintedError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Training(#[from] TrainingError),
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    File(#[from] FileError),
    /// The observer cannot write what it was told.
    #[error(transparent)]
    Output(#[from] std::io::Error),
}

//! What can end a reproduction before its end.

use std::path::PathBuf;

use super::ConfigError;
use crate::data::{DataError, EmptyPart};
use crate::evaluation::{EvaluationError, PrintedError, RecordError};
use crate::models::settings::ValueError;
use crate::report::FigureError;
use crate::run::{FileError, RunError};
use crate::training::TrainingError;

/// How results that are in the way are made again.
const REMEDY: &str = "remove that folder to make it again, or give another --out";

/// Why the rows of a table cannot be read, trained, evaluated or written.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    #[error("the folder of configs {folder} cannot be read: {cause}")]
    Folder {
        folder: PathBuf,
        cause: std::io::Error,
    },
    #[error("{folder} holds no config (.toml)")]
    NoConfig { folder: PathBuf },
    #[error("{file} is no row")]
    NoRow {
        file: PathBuf,
        source: Box<ConfigError>,
    },
    #[error("two configs in {folder} are called {name}; give each a name of its own")]
    SameName { folder: PathBuf, name: String },
    #[error("--seeds names {name} twice; give all its seeds in one list")]
    SeedsTwice { name: String },
    #[error("--seeds {name}")]
    Seeds { name: String, source: ValueError },
    #[error("{flag} {name}: {folder} has no such config, but {}", names.join(", "))]
    Unknown {
        flag: &'static str,
        name: String,
        folder: PathBuf,
        names: Vec<String>,
    },
    #[error(
        "rows of one table are on the same data, but {row} and {first} differ in {}",
        differences.join("; ")
    )]
    OtherDataConfig {
        row: String,
        first: String,
        differences: Vec<String>,
    },
    #[error("there are no rows")]
    NoRows,
    #[error(
        "{folder} holds results of another config ({}; values there, values now); {REMEDY}",
        differences.join("; ")
    )]
    OtherConfig {
        folder: PathBuf,
        differences: Vec<String>,
    },
    #[error(
        "{folder} holds results on data with digest {saved}, the data folder has digest {found}; {REMEDY}"
    )]
    OtherData {
        folder: PathBuf,
        saved: String,
        found: String,
    },
    /// What a row asks for cannot be trained.
    #[error("{row}")]
    Row {
        row: String,
        source: Box<TrainingError>,
    },
    #[error("no pool of {threads} threads: {cause}")]
    Threads {
        threads: usize,
        cause: rayon::ThreadPoolBuildError,
    },
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

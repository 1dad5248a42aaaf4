//! Why there is no study.

use std::path::PathBuf;

use crate::data::DataError;
use crate::motion::bvh::BvhError;
use crate::music::MusicError;
use crate::report::{FigureError, ReportError};
use crate::run::FileError;

/// Why a study's page cannot be made, or its ratings cannot be analysed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// What is asked for, or what a file says, makes no study: what, where, and what would.
    #[error("{0}")]
    Refused(String),
    #[error("the dances of {model}")]
    Dances {
        model: String,
        source: Box<DataError>,
    },
    #[error("the music of the study")]
    Music(#[source] Box<DataError>),
    #[error(transparent)]
    Sound(#[from] MusicError),
    #[error("{file} is not the key of a study; give the key.json that lies beside its page")]
    Key {
        file: PathBuf,
        source: serde_json::Error,
    },
    #[error("{file} is no table")]
    Table { file: PathBuf, source: csv::Error },
    #[error("a table cannot be written")]
    Written(#[from] csv::Error),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Clip(#[from] Box<DataError>),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Report(#[from] Box<ReportError>),
    #[error(transparent)]
    File(#[from] FileError),
}

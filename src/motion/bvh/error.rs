//! What can be wrong with a BVH file.

use std::path::PathBuf;

use thiserror::Error;

use crate::run::FileError;

/// Why a BVH file cannot be read or written.
#[derive(Debug, Error)]
pub enum BvhError {
    #[error("{path} cannot be read")]
    Read {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[error(transparent)]
    Write(#[from] FileError),
    /// The text is not BVH; `line` counts from 1.
    #[error("{file}, line {line}: expected {expected}, found {found}")]
    Syntax {
        file: String,
        line: usize,
        expected: String,
        found: String,
    },
    /// A document or clip made in memory is not one that a file could hold.
    #[error("{name} cannot be a BVH file: {fault}")]
    Document { name: String, fault: String },
}

//! Checkpoints: folders `step-XXXXXXXX` with `weights.safetensors` and `state.bin`, each there whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use thiserror::Error;

use super::durable::{self, FileError};
use super::state::{self, Header, Moments, StateError};
use crate::autograd::Parameters;
use crate::data::hexadecimal;
use crate::models::weights::{self, SavedWeights, WeightsError};

/// Name of the weights file, in a checkpoint and in a finished run.
pub const WEIGHTS_FILE: &str = "weights.safetensors";
/// Name of the file with the rest of the state.
pub const STATE_FILE: &str = "state.bin";
const PREFIX: &str = "step-";
const PARTIAL: &str = ".partial";

/// Why a checkpoint cannot be used.
#[derive(Debug, Error)]
pub enum CheckpointError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    State(#[from] StateError),
    #[error(transparent)]
    Weights(#[from] WeightsError),
    #[error("{path} is damaged: its digest is {found}, the state beside it says {expected}")]
    OtherWeights {
        path: PathBuf,
        found: String,
        expected: String,
    },
    #[error("{problem}")]
    Misfit { problem: String },
}

/// A checkpoint, read.
#[derive(Debug)]
pub struct Checkpoint {
    pub header: Header,
    pub moments: Moments,
    pub weights: SavedWeights,
}

impl Checkpoint {
    /// Reads a checkpoint of a model with these parameters.
    ///
    /// # Errors
    /// A file is missing, damaged, or not of such a model.
    pub fn read(folder: &Path, parameters: &Parameters<f32>) -> Result<Self, CheckpointError> {
        let (header, moments) = state::read(
            &folder.join(STATE_FILE),
            parameters.weights(),
            parameters.len(),
        )?;
        let path = folder.join(WEIGHTS_FILE);
        let content = weights::read_file(&path, parameters.weights())?;
        let found = file_digest(&content);
        if found != header.weights_file_digest {
            return Err(CheckpointError::OtherWeights {
                path,
                found,
                expected: header.weights_file_digest,
            });
        }
        Ok(Self {
            weights: SavedWeights::parse(&content, &path)?,
            header,
            moments,
        })
    }
}

/// SHA-256 of a file's content, hexadecimal.
pub(crate) fn file_digest(content: &[u8]) -> String {
    hexadecimal(&Sha256::digest(content))
}

/// The checkpoints in a folder, by step, the newest last; none where there is no folder.
///
/// # Errors
/// The folder cannot be read.
pub fn list(folder: &Path) -> Result<Vec<(u64, PathBuf)>, FileError> {
    let mut found = Vec::new();
    if folder.exists() {
        for entry in fs::read_dir(folder).map_err(FileError::at(folder, "read"))? {
            let entry = entry.map_err(FileError::at(folder, "read"))?;
            let name = entry.file_name();
            let step = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
            if let Some(step) = step.and_then(|digits| digits.parse().ok()) {
                found.push((step, entry.path()));
            }
        }
    }
    found.sort_unstable();
    Ok(found)
}

/// Writes a checkpoint, then removes all but the newest `keep`. Whenever this stops, the checkpoints before are whole.
pub(crate) fn write(
    folder: &Path,
    step: u64,
    weights: &[u8],
    state: &[u8],
    keep: usize,
) -> Result<(), FileError> {
    let name = format!("{PREFIX}{step:08}");
    let partial = folder.join(format!("{name}{PARTIAL}"));
    remove(&partial)?;
    fs::create_dir_all(&partial).map_err(FileError::at(&partial, "created"))?;
    durable::write_synced(&partial.join(WEIGHTS_FILE), weights)?;
    durable::write_synced(&partial.join(STATE_FILE), state)?;
    durable::sync_folder(&partial)?;
    let whole = folder.join(name);
    remove(&whole)?;
    durable::rename(&partial, &whole)?;
    let all = list(folder)?;
    for (_, old) in &all[..all.len().saturating_sub(keep)] {
        remove(old)?;
    }
    Ok(())
}

/// Removes what an interrupted [`write`] left.
pub(crate) fn remove_partial(folder: &Path) -> Result<(), FileError> {
    if folder.exists() {
        for entry in fs::read_dir(folder).map_err(FileError::at(folder, "read"))? {
            let path = entry.map_err(FileError::at(folder, "read"))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with(PREFIX) && name.ends_with(PARTIAL) {
                remove(&path)?;
            }
        }
    }
    Ok(())
}

/// Moves a damaged checkpoint out of the way, for whoever wants to look at it.
pub(crate) fn set_aside(path: &Path) -> Result<(), FileError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let aside = path.with_file_name(format!("damaged-{name}"));
    remove(&aside)?;
    durable::rename(path, &aside)
}

/// Removes a folder and what it holds, where it exists.
pub(crate) fn remove(folder: &Path) -> Result<(), FileError> {
    match fs::remove_dir_all(folder) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(FileError::at(folder, "removed")(error))
        }
        _ => Ok(()),
    }
}

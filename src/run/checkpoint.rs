//! Checkpoints: folders `step-XXXXXXXX` with `weights.safetensors` and `state.bin`, each there
//! whole or not at all.

use std::borrow::Cow;
use std::fs;
use std::path::{Path, PathBuf};

use super::durable::{self, FileError};
use super::error::RunError;
use super::state::{self, Header, Moments};
use crate::autograd::Parameters;
use crate::data::file_digest;
use crate::models::weights::{self, SavedWeights};

/// Name of the weights file, in a checkpoint and in a finished run.
pub const WEIGHTS_FILE: &str = "weights.safetensors";
/// Name of the file with the weights that a run started from.
pub const START_FILE: &str = "start.safetensors";
/// Name of the file with the rest of the state.
pub const STATE_FILE: &str = "state.bin";
const PREFIX: &str = "step-";
const PARTIAL: &str = ".partial";

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
    pub fn read(folder: &Path, parameters: &Parameters<f32>) -> Result<Self, RunError> {
        let state = folder.join(STATE_FILE);
        let (header, moments) = state::read(&state, parameters.weights(), parameters.len())?;
        let path = folder.join(WEIGHTS_FILE);
        let content = weights::read_file(&path, parameters.weights())?;
        let found = file_digest(&content);
        if found != header.weights_file_digest {
            return Err(RunError::Refused(format!(
                "{} is damaged: its digest is {found}, the state beside it says {}",
                path.display(),
                header.weights_file_digest
            )));
        }
        Ok(Self {
            weights: SavedWeights::parse(&content, &path)?,
            header,
            moments,
        })
    }
}

/// What lies in a folder; nothing where there is no folder.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, FileError> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect())
        .map_err(FileError::at(folder, "read"))
}

/// The name of a file or folder.
fn name(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or_default().to_string_lossy()
}

/// The checkpoints in a folder, by step, the newest last; none where there is no folder.
///
/// # Errors
/// The folder cannot be read.
pub fn list(folder: &Path) -> Result<Vec<(u64, PathBuf)>, FileError> {
    let step = |path: &Path| name(path).strip_prefix(PREFIX)?.parse().ok();
    let paths = entries(folder)?.into_iter();
    let found = paths.filter_map(|path| Some((step(&path)?, path)));
    let mut found: Vec<_> = found.collect();
    found.sort_unstable();
    Ok(found)
}

/// Writes a checkpoint, then removes all but the newest `keep`. Whenever this stops, the
/// checkpoints before are whole.
pub(crate) fn write(
    folder: &Path,
    step: u64,
    weights: &[u8],
    state: &[u8],
    keep: usize,
) -> Result<(), FileError> {
    let whole = folder.join(format!("{PREFIX}{step:08}"));
    let partial = folder.join(format!("{}{PARTIAL}", name(&whole)));
    durable::remove_folder(&partial)?;
    // The run's own folder is not made again where it was moved away meanwhile.
    for made in [folder, &partial] {
        if !made.is_dir() {
            fs::create_dir(made).map_err(FileError::at(made, "created"))?;
        }
    }
    durable::write_synced(&partial.join(WEIGHTS_FILE), weights)?;
    durable::write_synced(&partial.join(STATE_FILE), state)?;
    durable::sync_folder(&partial)?;
    durable::remove_folder(&whole)?;
    durable::rename(&partial, &whole)?;
    let all = list(folder)?;
    for (_, old) in &all[..all.len().saturating_sub(keep)] {
        durable::remove_folder(old)?;
    }
    Ok(())
}

/// Removes what an interrupted [`write`] left.
pub(crate) fn remove_partial(folder: &Path) -> Result<(), FileError> {
    for path in entries(folder)? {
        if name(&path).starts_with(PREFIX) && name(&path).ends_with(PARTIAL) {
            durable::remove_folder(&path)?;
        }
    }
    Ok(())
}

/// Moves a damaged checkpoint out of the way, for whoever wants to look at it.
pub(crate) fn set_aside(path: &Path) -> Result<(), FileError> {
    let aside = path.with_file_name(format!("damaged-{}", name(path)));
    durable::remove_folder(&aside)?;
    durable::rename(path, &aside)
}

//! Files that are there whole or not at all, whenever the process or the machine stops.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::Serialize;
use thiserror::Error;

use super::partial::Partial;

/// A file or folder that could not be dealt with.
#[derive(Debug, Error)]
#[error("{path} cannot be {action}: {cause}")]
pub struct FileError {
    pub path: PathBuf,
    /// "written", "read", "created", "removed", "locked".
    pub action: &'static str,
    pub cause: io::Error,
}

impl FileError {
    /// To be given to `map_err`.
    pub(crate) fn at(path: &Path, action: &'static str) -> impl FnOnce(io::Error) -> Self {
        move |cause| Self {
            path: path.into(),
            action,
            cause,
        }
    }
}

/// Writes a new file, down to the disk.
pub(crate) fn write_synced(path: &Path, content: &[u8]) -> Result<(), FileError> {
    let write = || -> io::Result<()> {
        let mut file = File::create(path)?;
        file.write_all(content)?;
        file.sync_all()
    };
    write().map_err(FileError::at(path, "written"))
}

/// Replaces a file by a whole new one: written beside it, then renamed. A pipe or device is written
/// to as it is.
pub(crate) fn replace(path: &Path, content: impl AsRef<[u8]>) -> Result<(), FileError> {
    // A link stays one.
    let real = path.canonicalize().unwrap_or_else(|_| path.into());
    if real.exists() && !real.is_file() {
        let file = File::options().write(true).open(&real);
        return file
            .and_then(|mut file| file.write_all(content.as_ref()))
            .map_err(FileError::at(path, "written"));
    }
    let write = || -> io::Result<()> {
        let (partial, mut file) = Partial::of(&real)?;
        file.write_all(content.as_ref())?;
        file.sync_all()?;
        partial.become_whole(&real)
    };
    write().map_err(FileError::at(path, "written"))?;
    sync_folder(real.parent().unwrap_or(Path::new("")))
}

/// Writes JSON for people and scripts, with a final line end, there whole or not at all.
pub(crate) fn write_json(path: &Path, content: &impl Serialize) -> Result<(), FileError> {
    let text = serde_json::to_string_pretty(content).map_err(io::Error::from);
    replace(path, text.map_err(FileError::at(path, "written"))? + "\n")
}

/// Removes a file where there is one.
pub(crate) fn remove(path: &Path) -> Result<(), FileError> {
    or_missing(fs::remove_file(path)).map_err(FileError::at(path, "removed"))
}

/// Removes a folder and what it holds, where there is one.
pub(crate) fn remove_folder(path: &Path) -> Result<(), FileError> {
    or_missing(fs::remove_dir_all(path)).map_err(FileError::at(path, "removed"))
}

fn or_missing(result: io::Result<()>) -> io::Result<()> {
    match result {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        result => result,
    }
}

/// Renames within one folder, down to the disk.
pub(crate) fn rename(from: &Path, to: &Path) -> Result<(), FileError> {
    fs::rename(from, to).map_err(FileError::at(to, "written"))?;
    sync_folder(to.parent().unwrap_or(Path::new("")))
}

/// Makes what was renamed in a folder last.
#[cfg(unix)]
pub(crate) fn sync_folder(path: &Path) -> Result<(), FileError> {
    let path = if path.as_os_str().is_empty() {
        Path::new(".")
    } else {
        path
    };
    File::open(path)
        .and_then(|folder| folder.sync_all())
        .map_err(FileError::at(path, "written"))
}

/// Other systems do not open folders.
#[cfg(not(unix))]
pub(crate) fn sync_folder(_path: &Path) -> Result<(), FileError> {
    Ok(())
}

//! One training at a time writes to a run's folder.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use super::durable::FileError;
use super::error::RunError;

/// The file that a training holds locked while it writes to the folder. It stays there: only the lock counts, and that ends with
/// the process, however it ends.
const LOCK: &str = ".lock";

/// A folder that nobody else writes to while this lives.
#[derive(Debug)]
pub(crate) struct FolderLock {
    /// None where the file system has no locks.
    _file: Option<File>,
}

impl FolderLock {
    /// Locks a folder that exists.
    ///
    /// # Errors
    /// Another training holds it, or it cannot be written.
    pub fn take(folder: &Path) -> Result<Self, RunError> {
        let path = folder.join(LOCK);
        let file = File::create(&path).map_err(FileError::at(&path, "created"))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { _file: Some(file) }),
            Err(TryLockError::WouldBlock) => Err(RunError::Locked {
                path: folder.into(),
            }),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                Ok(Self { _file: None })
            }
            Err(TryLockError::Error(error)) => Err(FileError::at(&path, "locked")(error).into()),
        }
    }

    /// Whether a training holds a folder at this moment.
    pub fn is_taken(folder: &Path) -> bool {
        let file = File::open(folder.join(LOCK));
        file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}

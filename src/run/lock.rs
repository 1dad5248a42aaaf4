//! One training at a time writes to a run's folder.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use super::durable::FileError;
use super::error::RunError;

/// The file that a training holds locked while it writes to the folder. It stays there: only the
/// lock counts, and that ends with the process, however it ends.
pub(super) const LOCK: &str = ".lock";

/// A folder that nobody else writes to while this lives.
#[derive(Debug)]
pub(crate) struct FolderLock {
    /// None where the file system has no locks.
    file: Option<File>,
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
            Ok(()) => Ok(Self { file: Some(file) }),
            Err(TryLockError::WouldBlock) => Err(RunError::Refused(format!(
                "another training writes to {} at this moment; wait for its end or stop it, or \
                 give another --out",
                folder.display()
            ))),
            Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
                Ok(Self { file: None })
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

impl Drop for FolderLock {
    /// Unlocks, as closing the file does not where a process that another thread has just begun
    /// still has it open.
    fn drop(&mut self) {
        if let Some(file) = &self.file {
            // What cannot be unlocked ends with the process.
            let _ = file.unlock();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_free_as_soon_as_its_lock_is_dropped_whoever_still_has_the_file_open() {
        let folder = tempfile::tempdir().unwrap();
        let lock = FolderLock::take(folder.path()).unwrap();
        let elsewhere = lock.file.as_ref().unwrap().try_clone().unwrap();
        assert!(FolderLock::is_taken(folder.path()));
        drop(lock);
        assert!(!FolderLock::is_taken(folder.path()));
        FolderLock::take(folder.path()).unwrap();
        drop(elsewhere);
    }
}

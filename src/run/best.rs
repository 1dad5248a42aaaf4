//! The weights of a training's best validation score: `best-XXXXXXXX.safetensors`, by the step.

use std::path::{Path, PathBuf};

use super::durable::{self, FileError};
use super::folder::RunFolder;

const PREFIX: &str = "best-";
const ENDING: &str = ".safetensors";

/// Whether a run's file of this name holds such weights.
pub(super) fn is_best(name: &str) -> bool {
    name.starts_with(PREFIX) && name.ends_with(ENDING)
}

impl RunFolder {
    /// Those of the latest such step, and the step; none where nothing was scored yet.
    pub(crate) fn best(&self) -> Option<(u64, PathBuf)> {
        let step = |path: &Path| -> Option<u64> {
            let name = path.file_name()?.to_str()?;
            name.strip_prefix(PREFIX)?
                .strip_suffix(ENDING)?
                .parse()
                .ok()
        };
        let parts = self.parts().into_iter();
        parts.filter_map(|path| Some((step(&path)?, path))).max()
    }

    /// Writes those of a step, in the place of an earlier one's.
    pub(crate) fn write_best(&self, step: u64, weights: &[u8]) -> Result<(), FileError> {
        let earlier = self.best();
        let path = self.path().join(format!("{PREFIX}{step:08}{ENDING}"));
        durable::replace(&path, weights)?;
        match earlier.filter(|(_, earlier)| *earlier != path) {
            Some((_, earlier)) => durable::remove(&earlier),
            None => Ok(()),
        }
    }

    /// Removes them.
    pub(crate) fn remove_best(&self) -> Result<(), FileError> {
        self.best()
            .map_or(Ok(()), |(_, path)| durable::remove(&path))
    }
}

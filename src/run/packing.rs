//! A run to pass on: what its model is used with, and nothing else.

use std::path::Path;

use super::durable::{FileError, replace as replace_file};
use super::error::RunError;
use super::folder::RunFolder;
use super::manifest::Manifest;
use super::output::check_output_folder;
use crate::data::file_digest;

impl RunFolder {
    /// Writes config, manifest and the newest weights into a folder, which is a run's folder then:
    /// large arrays of the weights in f16, without what a training would go on with.
    ///
    /// # Errors
    /// The run has no weights or a damaged file; the folder holds other files, unless `force` is
    /// given, or a run that a training wrote, whatever is given; a file cannot be written.
    pub fn pack(&self, folder: &Path, force: bool) -> Result<(), RunError> {
        let config = self.config()?;
        let weights = self.saved_weights(&config)?.to_half()?;
        check_output_folder(folder, force)?;
        let there = RunFolder::open(folder);
        if there.log_path().exists() || there.checkpoints().exists() || self.is_at(folder) {
            return Err(RunError::Refused(format!(
                "{} is a run's folder, whose weights would be lost; give another one",
                folder.display()
            )));
        }
        std::fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
        let packed = RunFolder::open(folder);
        packed.write_config(&config)?;
        if let Some(manifest) = self.manifest()? {
            let digest = manifest.weights_file_digest.is_some();
            packed.write_manifest(&Manifest {
                weights_file_digest: digest.then(|| file_digest(&weights)),
                ..manifest
            })?;
        }
        Ok(replace_file(&packed.weights(), weights)?)
    }

    fn is_at(&self, folder: &Path) -> bool {
        same_file::is_same_file(self.path(), folder).unwrap_or(false)
    }
}

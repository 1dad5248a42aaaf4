//! A run that comes inside the program.

use std::path::{Path, PathBuf};

use super::checkpoint::WEIGHTS_FILE;
use super::error::RunError;
use super::folder::RunFolder;
use super::manifest::Manifest;
use super::subject::Subject;
use crate::experiment::ExperimentConfig;
use crate::models::weights::SavedWeights;

/// The files of a packed run's folder.
#[derive(Debug, Clone, Copy)]
pub struct BuiltIn {
    /// Its folder in the repository.
    pub folder: &'static str,
    pub config: &'static str,
    pub manifest: &'static str,
    pub weights: &'static [u8],
}

impl BuiltIn {
    fn file(&self, name: &str) -> PathBuf {
        Path::new(self.folder).join(name)
    }
}

impl Subject {
    /// The model of a run that comes inside the program.
    ///
    /// # Errors
    /// Its files do not fit this version.
    pub fn built_in(run: &BuiltIn) -> Result<Self, RunError> {
        let file = run.file(RunFolder::CONFIG);
        let config = ExperimentConfig::parse(run.config, &file.display().to_string())?;
        let manifest = serde_json::from_str::<Manifest>(run.manifest)
            .map_err(|error| RunError::Refused(format!("{}: its manifest: {error}", run.folder)))?;
        let weights = SavedWeights::parse(run.weights, &run.file(WEIGHTS_FILE))?;
        let model = config.model.trained(&config.name, &weights)?;
        Ok(Self {
            what: format!("{}, which comes with keydance", config.name),
            config,
            model,
            run: None,
            manifest: Some(manifest),
            weights: Some(weights.digest),
        })
    }
}

//! A run's model with the newest weights of its training.

use std::path::PathBuf;

use super::checkpoint::{self, WEIGHTS_FILE};
use super::error::RunError;
use super::folder::RunFolder;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::models::weights::SavedWeights;

impl RunFolder {
    /// The newest weights of the run: those of its end, before it those of the newest checkpoint.
    ///
    /// # Errors
    /// The run has neither, or its checkpoints cannot be listed.
    pub fn newest_weights(&self) -> Result<PathBuf, RunError> {
        let end = self.weights();
        if end.exists() {
            return Ok(end);
        }
        match checkpoint::list(&self.checkpoints())?.pop() {
            Some((_, newest)) => Ok(newest.join(WEIGHTS_FILE)),
            None => Err(RunError::Refused(format!(
                "{} holds no weights, neither of a finished training nor of a checkpoint; train \
                 it with `keydance train`",
                self.path().display()
            ))),
        }
    }

    /// The model of `config` with the run's newest weights, and with the statistics that were saved
    /// with them.
    ///
    /// # Errors
    /// There are no weights, their file is damaged, or they are those of another model than
    /// `config` describes.
    pub fn trained_model(&self, config: &ExperimentConfig) -> Result<Box<dyn Generator>, RunError> {
        let saved = self.saved_weights(config)?;
        let model = config.model.trained(&config.name, &saved);
        model.map_err(|error| self.or_other_version(error.into()))
    }

    /// The run's newest weights, for the model of `config`.
    ///
    /// # Errors
    /// There are none, their file is damaged, or they are those of another model than `config`
    /// describes.
    pub fn saved_weights(&self, config: &ExperimentConfig) -> Result<SavedWeights, RunError> {
        self.read_weights(config)
            .map_err(|error| self.or_other_version(error))
    }

    fn read_weights(&self, config: &ExperimentConfig) -> Result<SavedWeights, RunError> {
        let path = self.newest_weights()?;
        let saved = SavedWeights::read(&path)?;
        let path = path.display();
        let trained = ExperimentConfig::parse(&saved.config, &format!("the config in {path}"))?;
        let mut differences = trained.training_differences(config)?;
        // Only the model's table concerns the weights.
        differences.retain(|difference| difference.starts_with("model."));
        match differences.is_empty() {
            true => Ok(saved),
            false => Err(RunError::Refused(format!(
                "{path} holds the weights of another model than the config describes ({}); values \
                 there, values of the config",
                differences.join("; ")
            ))),
        }
    }
}

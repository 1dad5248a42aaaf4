//! A run's model with the newest weights of its training.

use std::path::{Path, PathBuf};

use super::checkpoint::{self, START_FILE, WEIGHTS_FILE};
use super::durable::{FileError, replace as replace_file};
use super::error::RunError;
use super::folder::RunFolder;
use crate::data::Dataset;
use crate::experiment::ExperimentConfig;
use crate::models::exported_batch::{ExportOptions, ExportedBatch};
use crate::models::weights::SavedWeights;
use crate::models::{Generator, Streams, TaskSetting};

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
        self.model_of(config, &self.saved_weights(config)?)
    }

    /// The model of `config` with weights of the run.
    pub(super) fn model_of(
        &self,
        config: &ExperimentConfig,
        saved: &SavedWeights,
    ) -> Result<Box<dyn Generator>, RunError> {
        let model = config.model.trained(&config.name, saved);
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

    /// The weights that the run started from, where it did not start from drawn ones.
    ///
    /// # Errors
    /// Their file is damaged.
    pub fn start(&self) -> Result<Option<SavedWeights>, RunError> {
        let path = self.path().join(START_FILE);
        match path.exists() {
            true => Ok(Some(SavedWeights::read(&path)?)),
            false => Ok(None),
        }
    }

    /// Keeps a copy of the weights in a file that the run starts from.
    ///
    /// # Errors
    /// It cannot be read or written.
    pub fn keep_start(&self, weights: &Path) -> Result<(), RunError> {
        let content = std::fs::read(weights).map_err(FileError::at(weights, "read"))?;
        Ok(replace_file(&self.path().join(START_FILE), content)?)
    }

    /// Training windows with what the run's newest weights make of them.
    ///
    /// # Errors
    /// As [`RunFolder::saved_weights`]; there are no such windows.
    pub fn export_batch(
        &self,
        config: &ExperimentConfig,
        dataset: &Dataset,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, RunError> {
        let saved = self.saved_weights(config)?;
        let setting = TaskSetting {
            dataset,
            data: config.data.clone(),
            streams: Streams::new(config.seed),
            start: None,
        };
        Ok(config.model.export_batch(&saved, &setting, options)?)
    }

    /// The run's config, which says how its newest weights, if there are any, were trained.
    ///
    /// # Errors
    /// A file cannot be read, or the config was edited since.
    pub fn config_of_weights(&self) -> Result<ExperimentConfig, RunError> {
        let config = self.config()?;
        if let Ok(path) = self.newest_weights() {
            self.check_unedited(&SavedWeights::read(&path)?)?;
        }
        Ok(config)
    }

    fn read_weights(&self, config: &ExperimentConfig) -> Result<SavedWeights, RunError> {
        let saved = SavedWeights::read(&self.newest_weights()?)?;
        let mut differences = self.config_of(&saved)?.training_differences(config)?;
        // Only the model's table concerns the weights.
        differences.retain(|difference| difference.starts_with("model."));
        if !differences.is_empty() {
            return Err(RunError::Refused(format!(
                "{} holds the weights of another model than the config describes ({}); values \
                 there, values of the config",
                saved.path.display(),
                differences.join("; ")
            )));
        }
        self.check_unedited(&saved)?;
        Ok(saved)
    }

    /// The config that weights of the run were trained with.
    pub(crate) fn config_of(&self, weights: &SavedWeights) -> Result<ExperimentConfig, RunError> {
        let origin = format!("the config in {}", weights.path.display());
        let config = ExperimentConfig::parse_in(self.path(), &weights.config, &origin);
        Ok(config?)
    }

    /// Refuses a config that was edited since the weights were trained: what it says of data and
    /// training would not be theirs; and weights that are not the training's.
    fn check_unedited(&self, weights: &SavedWeights) -> Result<(), RunError> {
        let trained = self.config_of(weights)?;
        match &trained.differences(&self.config()?)?[..] {
            [] => self.check_end(weights),
            differences => Err(RunError::Refused(format!(
                "{} was edited since {} was trained ({}; values then, values now); set these back, \
                 and use --set where a command is to take others",
                self.config_path().display(),
                weights.path.display(),
                differences.join("; ")
            ))),
        }
    }

    /// Refuses weights in the place of those with which the run's training ended.
    fn check_end(&self, weights: &SavedWeights) -> Result<(), RunError> {
        let ended = self.manifest()?.and_then(|it| it.weights_file_digest);
        match ended.filter(|_| weights.path == self.weights()) {
            Some(ended) if ended != weights.digest => Err(RunError::Refused(format!(
                "{} is not the file with which the training in {} ended (digest {}, the manifest \
                 says {ended}): it was changed, or is another run's; put it back",
                weights.path.display(),
                self.path().display(),
                weights.digest
            ))),
            _ => Ok(()),
        }
    }
}

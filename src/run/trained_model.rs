//! A run's model with the newest weights of its training.

use std::path::PathBuf;

use super::checkpoint::{self, WEIGHTS_FILE};
use super::folder::RunFolder;
use crate::autograd::Parameters;
use crate::experiment::config::ExperimentConfig;
use crate::models::streams::Streams;
use crate::models::transition::TrainedModel;
use crate::models::weights::SavedWeights;
use crate::nn::Initialiser;
use crate::training::error::TrainingError;

impl RunFolder {
    /// The newest weights of the run: those of its end, before it those of the newest checkpoint.
    ///
    /// # Errors
    /// The run has neither, or its checkpoints cannot be listed.
    pub fn newest_weights(&self) -> Result<PathBuf, TrainingError> {
        let end = self.weights();
        if end.exists() {
            return Ok(end);
        }
        match checkpoint::list(&self.checkpoints())?.pop() {
            Some((_, newest)) => Ok(newest.join(WEIGHTS_FILE)),
            None => Err(TrainingError::NoWeights {
                path: self.path().into(),
            }),
        }
    }

    /// The model of `config` with the run's newest weights, and with the statistics that were saved with them.
    ///
    /// # Errors
    /// There are no weights, their file is damaged, or they are those of another model than `config` describes.
    pub fn trained_model(&self, config: &ExperimentConfig) -> Result<TrainedModel, TrainingError> {
        self.read_model(config)
            .map_err(|error| self.or_other_version(error))
    }

    fn read_model(&self, config: &ExperimentConfig) -> Result<TrainedModel, TrainingError> {
        let path = self.newest_weights()?;
        let saved = SavedWeights::read(&path)?;
        let origin = format!("the config in {}", path.display());
        // Only the model's table concerns the weights.
        let trained = ExperimentConfig {
            model: ExperimentConfig::parse(&saved.config, &origin)?.model,
            ..config.clone()
        };
        let differences = trained.training_differences(config)?;
        if !differences.is_empty() {
            return Err(TrainingError::OtherModel { path, differences });
        }
        let mut parameters = Parameters::new();
        let rng = Streams::new(config.seed).initialisation();
        let mut init = Initialiser::limited(&mut parameters, rng, saved.most_weights());
        let network = config.model.build(&mut init, &saved.standardisation)?;
        saved.load_into(&mut parameters)?;
        Ok(TrainedModel::new(
            config.name.clone(),
            network,
            parameters,
            saved.standardisation,
            config.model.root_frame(),
        )
        .refining_velocities(config.model.refines_velocities()))
    }
}

//! The model that a command works with: a trained run's, or one that needs no training.

use std::path::Path;

use super::durable::FileError;
use super::error::RunError;
use super::folder::RunFolder;
use crate::data::Dataset;
use crate::experiment::ExperimentConfig;
use crate::models::Generator;

/// A model to work with, its config, and where they come from.
pub struct Subject {
    pub config: ExperimentConfig,
    pub model: Box<dyn Generator>,
    /// What to call it in the output.
    pub what: String,
    /// The run's folder; none for a config.
    pub run: Option<RunFolder>,
}

impl Subject {
    /// Opens a run's folder, or the config of a model that needs no training; `set` overrides keys
    /// of the config.
    ///
    /// # Errors
    /// There is no such run or config, its model is not trained, or its weights are damaged.
    pub fn open(path: &Path, set: &[String]) -> Result<Self, RunError> {
        let run = path.is_dir().then(|| RunFolder::open(path));
        let file = run.as_ref().map_or(path.into(), RunFolder::config_path);
        let path = path.display();
        if run.is_some() && !file.exists() {
            return Err(RunError::Refused(format!(
                "{path} is not a run's folder: it has no {}; `keydance train` makes one",
                RunFolder::CONFIG
            )));
        }
        let config = ExperimentConfig::load(&file, set)?;
        let (model, source) = match (config.model.untrained(&config.data), &run) {
            (Some(model), _) => (model, format!(" of {path}")),
            (None, Some(run)) => {
                let weights = run.newest_weights()?;
                (
                    run.trained_model(&config)?,
                    format!(", {}", weights.display()),
                )
            }
            (None, None) => {
                return Err(RunError::Refused(format!(
                    "{path} describes a model that is trained; train it with `keydance train \
                     {path} --data DIR --out RUN_DIR` and give RUN_DIR instead"
                )));
            }
        };
        Ok(Self {
            what: format!("{}{source}", config.name),
            config,
            model,
            run,
        })
    }

    /// Refuses data that the run was not trained on: its training clips may be test clips there.
    ///
    /// # Errors
    /// The config reads or splits the data otherwise than the run's, or the data has another digest
    /// than the run's manifest says.
    pub fn check_data(&self, dataset: &Dataset, folder: &Path) -> Result<(), RunError> {
        let Some(run) = &self.run else {
            return Ok(());
        };
        let differences = self.data_differences(run)?;
        if !differences.is_empty() {
            return Err(RunError::Refused(format!(
                "{} was trained on other clips or features of the data ({}; values there, values \
                 now), so some of these may be its training clips; give --other-data to use it on \
                 them all the same",
                run.path().display(),
                differences.join("; ")
            )));
        }
        if let Some(manifest) = run.manifest()?
            && manifest.data_digest != dataset.digest
        {
            return Err(RunError::Refused(format!(
                "{} was trained on data with digest {}, {} has digest {}; give --other-data to use \
                 it there all the same",
                manifest.name,
                manifest.data_digest,
                folder.display(),
                dataset.digest
            )));
        }
        Ok(())
    }

    /// What differs from the `[data]` that the run was trained with.
    fn data_differences(&self, run: &RunFolder) -> Result<Vec<String>, RunError> {
        let trained = ExperimentConfig {
            data: run.config()?.data,
            ..self.config.clone()
        };
        Ok(trained.differences(&self.config)?)
    }

    /// Refuses a rate, or another key of the features, that the run was not trained with: its model
    /// would misread every pose.
    ///
    /// # Errors
    /// The key, with both values.
    pub fn check_features(&self) -> Result<(), RunError> {
        let Some(run) = &self.run else {
            return Ok(());
        };
        let keys = ["data.fps:", "data.contact_threshold:", "data.facing_sigma:"];
        let mut differences = self.data_differences(run)?;
        differences.retain(|difference| keys.iter().any(|key| difference.starts_with(key)));
        match &differences[..] {
            [] => Ok(()),
            _ => Err(RunError::Refused(format!(
                "{} was trained on other features ({}; values there, values now); leave these out",
                run.path().display(),
                differences.join("; ")
            ))),
        }
    }

    /// The folder that keeps the scores: the run's, or for a config `out`, made with the config in
    /// it; none where there is neither.
    ///
    /// # Errors
    /// `out` holds another config, or cannot be written.
    pub fn scores_folder<'a>(
        &'a self,
        out: Option<&'a Path>,
    ) -> Result<Option<&'a Path>, RunError> {
        if let Some(run) = &self.run {
            return Ok(Some(run.path()));
        }
        let Some(folder) = out else {
            return Ok(None);
        };
        std::fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
        let run = RunFolder::open(folder);
        if run.config_path().exists() {
            let differences = run.config()?.differences(&self.config)?;
            if !differences.is_empty() {
                return Err(RunError::Refused(format!(
                    "{} holds scores of another config ({}); values there, values now; give \
                     another --out",
                    folder.display(),
                    differences.join("; ")
                )));
            }
        }
        run.write_config(&self.config)?;
        Ok(Some(folder))
    }
}

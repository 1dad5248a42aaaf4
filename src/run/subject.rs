//! The model that a command works with: a trained run's, or one that needs no training.

use std::path::{Path, PathBuf};

use super::durable::{self, FileError};
use super::error::RunError;
use super::folder::RunFolder;
use crate::data::Dataset;
use crate::experiment::{ConfigError, ExperimentConfig};
use crate::models::Generator;

/// Why there is no model to work with, or why it does not go with the data.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    File(#[from] FileError),
    #[error(
        "{path} describes a model that is trained; train it with `keydance train {path} --data DIR --out RUN_DIR` and \
         give RUN_DIR instead"
    )]
    Untrained { path: PathBuf },
    #[error(
        "{path} is not a run's folder: it has no {}; `keydance train` makes one",
        RunFolder::CONFIG
    )]
    NoRun { path: PathBuf },
    #[error(
        "{run} was trained on other clips or features of the data ({}; values there, values now), so some of these may be its \
         training clips; give --other-data to use it on them all the same",
        differences.join("; ")
    )]
    OtherClips {
        run: PathBuf,
        differences: Vec<String>,
    },
    #[error(
        "{name} was trained on data with digest {trained}, {folder} has digest {found}; give --other-data to use it there all the same"
    )]
    OtherData {
        name: String,
        trained: String,
        folder: PathBuf,
        found: String,
    },
    #[error(
        "{folder} holds scores of another config ({}); values there, values now; give another --out",
        differences.join("; ")
    )]
    OtherScores {
        folder: PathBuf,
        differences: Vec<String>,
    },
}

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
    pub fn open(path: &Path, set: &[String]) -> Result<Self, SubjectError> {
        if !path.is_dir() {
            let config = ExperimentConfig::load(path, set)?;
            let model = config
                .model
                .untrained(&config.data)
                .ok_or_else(|| SubjectError::Untrained { path: path.into() })?;
            return Ok(Self {
                what: format!("{} of {}", config.name, path.display()),
                config,
                model,
                run: None,
            });
        }
        let run = RunFolder::open(path);
        if !run.config_path().exists() {
            return Err(SubjectError::NoRun { path: path.into() });
        }
        let config = ExperimentConfig::load(&run.config_path(), set)?;
        let (model, what) = match config.model.untrained(&config.data) {
            Some(model) => (model, format!("{} of {}", config.name, path.display())),
            None => {
                let weights = run.newest_weights()?;
                let what = format!("{}, {}", config.name, weights.display());
                (run.trained_model(&config)?, what)
            }
        };
        Ok(Self {
            config,
            model,
            what,
            run: Some(run),
        })
    }

    /// Refuses data that the run was not trained on: its training clips may be test clips there.
    ///
    /// # Errors
    /// The config reads or splits the data otherwise than the run's, or the data has another digest
    /// than the run's manifest says.
    pub fn check_data(&self, dataset: &Dataset, folder: &Path) -> Result<(), SubjectError> {
        let Some(run) = &self.run else {
            return Ok(());
        };
        let trained = run.config()?.data;
        if trained != self.config.data {
            let config = |data| ExperimentConfig {
                data,
                ..ExperimentConfig::default()
            };
            let differences = config(trained).differences(&config(self.config.data.clone()))?;
            return Err(SubjectError::OtherClips {
                run: run.path().into(),
                differences,
            });
        }
        if let Some(manifest) = run.manifest()?
            && manifest.data_digest != dataset.digest
        {
            return Err(SubjectError::OtherData {
                name: manifest.name,
                trained: manifest.data_digest,
                folder: folder.into(),
                found: dataset.digest.clone(),
            });
        }
        Ok(())
    }

    /// The folder that keeps the scores: the run's, or for a config `out`, made with the config in
    /// it; none where there is neither.
    ///
    /// # Errors
    /// `out` holds another config, or cannot be written.
    pub fn scores_folder<'a>(
        &'a self,
        out: Option<&'a Path>,
    ) -> Result<Option<&'a Path>, SubjectError> {
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
                return Err(SubjectError::OtherScores {
                    folder: folder.into(),
                    differences,
                });
            }
        }
        durable::replace(&run.config_path(), self.config.to_toml()?.as_bytes())?;
        Ok(Some(folder))
    }
}

//! A run's folder.
//!
//! ```text
//! config.toml            the resolved config
//! manifest.json          what was trained, on what, where, and how far it got
//! log.jsonl              a line a step: every loss term
//! checkpoints/step-*/    weights.safetensors and state.bin
//! weights.safetensors    the trained model, once finished
//! ```

use std::fs;
use std::path::{Path, PathBuf};

use super::checkpoint::{self, WEIGHTS_FILE};
use super::config::ExperimentConfig;
use super::durable::{self, FileError};
use super::error::TrainingError;
use super::log::{self, LogLine};
use super::manifest::Manifest;
use super::streams::Streams;
use crate::autograd::Parameters;
use crate::models::TrainedModel;
use crate::models::weights::SavedWeights;
use crate::nn::Initialiser;

const CONFIG: &str = "config.toml";
const MANIFEST: &str = "manifest.json";
const LOG: &str = "log.jsonl";
const CHECKPOINTS: &str = "checkpoints";

/// A folder that holds one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunFolder {
    path: PathBuf,
}

impl RunFolder {
    /// A folder for a new run; made where there is none.
    ///
    /// # Errors
    /// The folder holds a run already, or cannot be written.
    pub fn create(path: &Path, config: &ExperimentConfig) -> Result<Self, TrainingError> {
        let run = Self { path: path.into() };
        if [CONFIG, CHECKPOINTS, WEIGHTS_FILE]
            .iter()
            .any(|name| path.join(name).exists())
        {
            return Err(TrainingError::RunExists { path: path.into() });
        }
        fs::create_dir_all(path).map_err(FileError::at(path, "created"))?;
        durable::replace(&path.join(CONFIG), config.to_toml()?.as_bytes())?;
        Ok(run)
    }

    /// A folder for a new run, in place of an earlier run of the same name.
    ///
    /// # Errors
    /// The folder holds a run of another name, or cannot be written.
    pub fn replace(path: &Path, config: &ExperimentConfig) -> Result<Self, TrainingError> {
        let run = Self::open(path);
        if run.config_path().exists() && run.config()?.name == config.name {
            checkpoint::remove(&run.checkpoints())?;
            for file in [MANIFEST, LOG, WEIGHTS_FILE, CONFIG].map(|name| path.join(name)) {
                match fs::remove_file(&file) {
                    Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                        return Err(FileError::at(&file, "removed")(error).into());
                    }
                    _ => {}
                }
            }
        }
        Self::create(path, config)
    }

    /// The folder of a run that goes on; a new run where it has not begun.
    ///
    /// # Errors
    /// The run there has another config, or the folder cannot be read or written.
    pub fn resume(path: &Path, config: &ExperimentConfig) -> Result<Self, TrainingError> {
        let run = Self { path: path.into() };
        if !path.join(CONFIG).exists() {
            return Self::create(path, config);
        }
        let saved = run.config()?;
        let differences = saved.differences(config)?;
        if !differences.is_empty() {
            return Err(TrainingError::OtherConfig {
                path: path.join(CONFIG),
                differences,
            });
        }
        checkpoint::remove_partial(&run.checkpoints())?;
        Ok(run)
    }

    /// The folder of a run, as it is.
    pub fn open(path: &Path) -> Self {
        Self { path: path.into() }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of checkpoints.
    pub fn checkpoints(&self) -> PathBuf {
        self.path.join(CHECKPOINTS)
    }

    /// The weights of a finished run.
    pub fn weights(&self) -> PathBuf {
        self.path.join(WEIGHTS_FILE)
    }

    /// The file of the resolved config.
    pub fn config_path(&self) -> PathBuf {
        self.path.join(CONFIG)
    }

    /// The file of the manifest.
    pub fn manifest_path(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// The resolved config.
    ///
    /// # Errors
    /// It cannot be read, or this version does not know one of its keys.
    pub fn config(&self) -> Result<ExperimentConfig, TrainingError> {
        Ok(ExperimentConfig::load(&self.config_path(), &[])?)
    }

    /// The trained model.
    ///
    /// # Errors
    /// The training is not finished; the weights are damaged, or not those of the model that their config describes.
    pub fn model(&self) -> Result<TrainedModel, TrainingError> {
        let path = self.weights();
        if !path.exists() {
            return Err(TrainingError::NotFinished { path });
        }
        let saved = SavedWeights::read(&path)?;
        let config = ExperimentConfig::parse(&saved.config, &path.display().to_string())?;
        let mut parameters = Parameters::new();
        let rng = Streams::new(config.seed).initialisation();
        let mut init = Initialiser::limited(&mut parameters, rng, saved.most_weights());
        let network = config.model.build(&mut init, &saved.standardisation)?;
        saved.load_into(&mut parameters)?;
        Ok(TrainedModel::new(
            config.name,
            network,
            parameters,
            saved.standardisation,
            config.model.root_frame(),
        ))
    }

    /// The file of the log.
    pub(super) fn log_path(&self) -> PathBuf {
        self.path.join(LOG)
    }

    /// The lines of the log; none before the training has begun.
    ///
    /// # Errors
    /// It cannot be read or holds something else.
    pub fn log(&self) -> Result<Vec<LogLine>, TrainingError> {
        log::read(&self.log_path())
    }

    /// The manifest; none before the training has begun.
    ///
    /// # Errors
    /// It cannot be read or is none.
    pub fn manifest(&self) -> Result<Option<Manifest>, TrainingError> {
        let path = self.manifest_path();
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(FileError::at(&path, "read"))?;
        match serde_json::from_str(&text) {
            Ok(manifest) => Ok(Some(manifest)),
            Err(cause) => Err(TrainingError::Manifest { path, cause }),
        }
    }

    pub(super) fn write_manifest(&self, manifest: &Manifest) -> Result<(), TrainingError> {
        let path = self.manifest_path();
        let mut text =
            serde_json::to_vec_pretty(manifest).map_err(|cause| TrainingError::Manifest {
                path: path.clone(),
                cause,
            })?;
        text.push(b'\n');
        Ok(durable::replace(&path, &text)?)
    }

    pub(super) fn write_weights(&self, content: &[u8]) -> Result<(), FileError> {
        durable::replace(&self.weights(), content)
    }
}

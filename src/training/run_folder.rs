//! A run's folder.
//!
//! ```text
//! config.toml            the resolved config
//! manifest.json          what was trained, on what, where, and how far it got
//! log.jsonl              a line a step: every loss term
//! checkpoints/step-*/    weights.safetensors and state.bin
//! weights.safetensors    the trained model, once finished
//! ```

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::checkpoint::{self, WEIGHTS_FILE};
use super::config::ExperimentConfig;
use super::durable::{self, FileError};
use super::error::TrainingError;
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
        let mut init = Initialiser::new(&mut parameters, rng);
        let network = config.model.build(&mut init, &saved.standardisation)?;
        saved.load_into(&mut parameters)?;
        Ok(TrainedModel::new(
            config.name,
            network,
            parameters,
            saved.standardisation,
        ))
    }

    /// The manifest; none before the training has begun.
    ///
    /// # Errors
    /// It cannot be read or is none.
    pub fn manifest(&self) -> Result<Option<Manifest>, TrainingError> {
        let path = self.path.join(MANIFEST);
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
        let path = self.path.join(MANIFEST);
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

/// `log.jsonl`, open for more lines.
pub(super) struct Log {
    path: PathBuf,
    file: File,
}

#[derive(Deserialize)]
struct Line {
    step: u64,
}

impl Log {
    /// Opens a run's log and cuts it back to the lines of the first `steps` steps.
    pub fn open(run: &RunFolder, steps: u64) -> Result<Self, FileError> {
        let path = run.path.join(LOG);
        let at = |action| FileError::at(&path, action);
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(&path)
            .map_err(at("written"))?;
        let mut reader = BufReader::new(&file);
        let (mut kept, mut line) = (0, Vec::new());
        loop {
            line.clear();
            let read = reader.read_until(b'\n', &mut line).map_err(at("read"))?;
            let whole = line.ends_with(b"\n");
            match serde_json::from_slice::<Line>(&line) {
                Ok(Line { step }) if whole && step <= steps => kept += read as u64,
                _ => break,
            }
        }
        file.set_len(kept).map_err(at("written"))?;
        Ok(Self { path, file })
    }

    /// Adds a line.
    pub fn write(&mut self, report: &super::StepReport) -> Result<(), FileError> {
        let line = serde_json::to_vec(report).map_err(std::io::Error::from);
        line.and_then(|mut line| {
            line.push(b'\n');
            self.file.write_all(&line)
        })
        .map_err(FileError::at(&self.path, "written"))
    }

    /// Makes what was written last.
    pub fn sync(&self) -> Result<(), FileError> {
        self.file
            .sync_data()
            .map_err(FileError::at(&self.path, "written"))
    }
}

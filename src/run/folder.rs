//! A run's folder.
//!
//! ```text
//! config.toml            the resolved config
//! manifest.json          what was trained, on what, where, and how far it got
//! log.jsonl              a line a step: every loss term
//! checkpoints/step-*/    weights.safetensors and state.bin
//! weights.safetensors    the trained model, once finished
//! evaluation*.json       its scores, and on what they were measured, once evaluated
//! .lock                  locked while a training writes here
//! ```

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};

use super::best::is_best;
use super::checkpoint::{self, START_FILE, WEIGHTS_FILE};
use super::durable::{self, FileError};
use super::error::RunError;
use super::lock::{FolderLock, LOCK};
use super::log::{self, LogLine};
use super::manifest::{self, Build, Manifest};
use super::partial::Partial;
use crate::experiment::ExperimentConfig;

const MANIFEST: &str = "manifest.json";
const LOG: &str = "log.jsonl";
const CHECKPOINTS: &str = "checkpoints";

/// A folder that holds one run. To write to it takes [`RunFolder::create`], [`RunFolder::replace`]
/// or [`RunFolder::resume`], which keep all others from doing so while the value lives.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// None where it was opened to be read.
    _lock: Option<FolderLock>,
}

impl RunFolder {
    /// Name of the resolved config's file: a folder that has it is a run's.
    pub const CONFIG: &str = "config.toml";

    /// A folder for a new run; made where there is none.
    ///
    /// # Errors
    /// The folder holds a run already or other files, another training writes to it, or it cannot
    /// be written.
    pub fn create(path: &Path, config: &ExperimentConfig) -> Result<Self, RunError> {
        // What no training has locked before stays without a lock.
        if !path.join(LOCK).exists() {
            Self::open(path).check_empty()?;
        }
        let run = Self::locked(path)?;
        run.check_empty()?;
        run.begin(config)?;
        Ok(run)
    }

    /// A folder for a new run, in place of an earlier run of the same name.
    ///
    /// # Errors
    /// The folder holds a run of another name, another training writes to it, or it cannot be
    /// written.
    pub fn replace(path: &Path, config: &ExperimentConfig) -> Result<Self, RunError> {
        let run = Self::locked(path)?;
        if run.config_path().exists() {
            let name = run.config()?.name;
            if name != config.name {
                return Err(RunError::Refused(format!(
                    "{} holds the run {name}; give another --out",
                    path.display()
                )));
            }
            durable::remove_folder(&run.checkpoints())?;
            run.remove_best()?;
            for name in [MANIFEST, LOG, WEIGHTS_FILE, START_FILE, Self::CONFIG] {
                durable::remove(&path.join(name))?;
            }
        }
        run.begin(config)?;
        Ok(run)
    }

    /// The folder of a run that goes on; a new run where it has not begun.
    ///
    /// # Errors
    /// The run there has another config, another training writes to it, or it cannot be read or
    /// written.
    pub fn resume(path: &Path, config: &ExperimentConfig) -> Result<Self, RunError> {
        let there = Self::open(path);
        let is_new = !there.config_path().exists();
        if is_new {
            if let Some(part) = there.part_of_a_run() {
                return Err(RunError::Refused(format!(
                    "{} holds {part} of a run without its {}; put that back, or give another --out",
                    path.display(),
                    Self::CONFIG
                )));
            }
            there.check_empty()?;
        }
        let run = Self::locked(path)?;
        if is_new {
            run.begin(config)?;
            return Ok(run);
        }
        run.check_config(&run.config()?.differences(config)?)?;
        checkpoint::remove_partial(&run.checkpoints())?;
        if run.weights().exists() && checkpoint::list(&run.checkpoints())?.is_empty() {
            return Err(RunError::Refused(format!(
                "{} holds weights and no checkpoint, as a packed run does: a training cannot go on \
                 from it; give another --out",
                path.display()
            )));
        }
        Ok(run)
    }

    /// The folder of a run, as it is, to read.
    pub fn open(path: &Path) -> Self {
        Self {
            path: path.into(),
            _lock: None,
        }
    }

    fn locked(path: &Path) -> Result<Self, RunError> {
        fs::create_dir_all(path).map_err(FileError::at(path, "created"))?;
        Ok(Self {
            path: path.into(),
            _lock: Some(FolderLock::take(path)?),
        })
    }

    /// Whether a file is one of those that make up the run in a folder.
    pub(super) fn has_part(folder: &Path, file: &Path) -> bool {
        let inside = file.strip_prefix(folder).ok();
        let name = inside.and_then(|inside| inside.iter().next());
        let name = name.unwrap_or_default().to_string_lossy().to_lowercase();
        let own = [
            Self::CONFIG,
            MANIFEST,
            LOG,
            CHECKPOINTS,
            WEIGHTS_FILE,
            START_FILE,
            LOCK,
        ];
        let is_own = own.contains(&&*name)
            || is_best(&name)
            || name.starts_with("evaluation") && name.ends_with(".json");
        is_own && folder.join(Self::CONFIG).is_file()
    }

    /// The files right in the folder that make up the run, those that are there.
    pub fn parts(&self) -> Vec<PathBuf> {
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        let files = entries.map(|entry| entry.path());
        files
            .filter(|file| Self::has_part(&self.path, file) && file.is_file())
            .collect()
    }

    fn begin(&self, config: &ExperimentConfig) -> Result<(), RunError> {
        self.check_new()?;
        self.write_config(config)
    }

    /// Refuses a folder that holds what a run would write.
    fn check_new(&self) -> Result<(), RunError> {
        if self.part_of_a_run().is_some() {
            return Err(RunError::Refused(format!(
                "{} holds a run already; go on with --resume, or give another --out",
                self.path.display()
            )));
        }
        Ok(())
    }

    /// A file or folder of a run that is there.
    fn part_of_a_run(&self) -> Option<&'static str> {
        let own = [Self::CONFIG, MANIFEST, LOG, CHECKPOINTS, WEIGHTS_FILE];
        own.into_iter().find(|name| self.path.join(name).exists())
    }

    /// Refuses a folder that holds other files: a run would write among them.
    fn check_empty(&self) -> Result<(), RunError> {
        self.check_new()?;
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        let mut names = entries.map(|entry| entry.file_name());
        // A process that was killed may have left the beginning of the config.
        let is_own = |name: &OsString| name == LOCK || Partial::is_name(&name.to_string_lossy());
        match names.find(|name| !is_own(name)) {
            None => Ok(()),
            Some(name) => Err(RunError::Refused(format!(
                "{} holds other files, such as {}; give another --out",
                self.path.display(),
                name.to_string_lossy()
            ))),
        }
    }

    /// Refuses a config that differs from the run's in these keys.
    pub(crate) fn check_config(&self, differences: &[String]) -> Result<(), RunError> {
        match differences {
            [] => Ok(()),
            _ => Err(RunError::Refused(format!(
                "{} holds a run with another config ({}); values there, values now; a run is \
                 resumed with the config and the --set that it was started with",
                self.config_path().display(),
                differences.join("; ")
            ))),
        }
    }

    /// Refuses data with another digest than `saved`, which `path` was trained on.
    pub(crate) fn check_data(path: &Path, saved: &str, found: &str) -> Result<(), RunError> {
        match saved == found {
            true => Ok(()),
            false => Err(RunError::Refused(format!(
                "{} was trained on data with digest {saved}, the data now has digest \
                 {found}",
                path.display()
            ))),
        }
    }

    /// Writes the resolved config.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(crate) fn write_config(&self, config: &ExperimentConfig) -> Result<(), RunError> {
        Ok(durable::replace(&self.config_path(), config.to_toml()?)?)
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

    /// Refuses to go on writing to a folder that is no longer there as it was begun.
    ///
    /// # Errors
    /// Its config is not there.
    pub(crate) fn check_is_there(&self) -> Result<(), RunError> {
        match self.config_path().is_file() {
            true => Ok(()),
            false => Err(RunError::Refused(format!(
                "{} was moved or removed, or its {} was, while the training wrote to it; put it \
                 back, and --resume goes on from its newest checkpoint",
                self.path.display(),
                Self::CONFIG
            ))),
        }
    }

    /// The file of the resolved config.
    pub fn config_path(&self) -> PathBuf {
        self.path.join(Self::CONFIG)
    }

    /// The file of the manifest.
    pub fn manifest_path(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// The resolved config.
    ///
    /// # Errors
    /// It cannot be read, or this version does not know one of its keys.
    pub fn config(&self) -> Result<ExperimentConfig, RunError> {
        ExperimentConfig::load(&self.config_path(), &[])
            .map_err(|error| self.or_other_version(error.into()))
    }

    /// The file of the log.
    pub(crate) fn log_path(&self) -> PathBuf {
        self.path.join(LOG)
    }

    /// The lines of the log; none before the training has begun.
    ///
    /// # Errors
    /// It cannot be read or holds something else.
    pub fn log(&self) -> Result<Vec<LogLine>, RunError> {
        log::read(&self.log_path())
    }

    /// The manifest; none before the training has begun.
    ///
    /// # Errors
    /// It cannot be read, is none, or is of a newer version of the program.
    pub fn manifest(&self) -> Result<Option<Manifest>, RunError> {
        let path = self.manifest_path();
        if !path.exists() {
            return Ok(None);
        }
        let text = fs::read_to_string(&path).map_err(FileError::at(&path, "read"))?;
        let problem = match serde_json::from_str::<Manifest>(&text) {
            Ok(manifest) if manifest.format <= manifest::FORMAT => return Ok(Some(manifest)),
            Ok(Manifest { format, .. }) => format!(
                "has format {format}, and this version of keydance knows formats up to {}",
                manifest::FORMAT
            ),
            Err(cause) => format!("is not a manifest: {cause}"),
        };
        let error = RunError::Refused(format!("{} {problem}", path.display()));
        Err(self.or_other_version(error))
    }

    /// The error, with the version of the program that made the run where it is another one: what
    /// such a run holds cannot always be read or gone on with.
    pub(crate) fn or_other_version(&self, error: RunError) -> RunError {
        let text = fs::read_to_string(self.path.join(MANIFEST)).unwrap_or_default();
        let this = Build::this();
        match serde_json::from_str::<Build>(&text) {
            Ok(made_by) if made_by != this => RunError::Refused(format!(
                "{} was made by keydance {made_by}, this is {this}, which cannot use it: {error}",
                self.path.display()
            )),
            _ => error,
        }
    }

    pub(crate) fn write_manifest(&self, manifest: &Manifest) -> Result<(), FileError> {
        durable::write_json(&self.manifest_path(), manifest)
    }

    pub(crate) fn write_weights(&self, content: &[u8]) -> Result<(), FileError> {
        durable::replace(&self.weights(), content)
    }
}

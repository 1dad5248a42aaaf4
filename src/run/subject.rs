//! The model that a command works with: a trained run's, or one that needs no training.

use std::path::{Path, PathBuf};

use super::durable::FileError;
use super::error::RunError;
use super::folder::RunFolder;
use super::manifest::Manifest;
use super::output::{check_output_folder, place};
use crate::data::{Dataset, is_clip};
use crate::evaluation::{EvaluatedData, EvaluationRecord};
use crate::experiment::{ConfigError, ExperimentConfig};
use crate::models::Generator;

/// A model to work with, its config, and where they come from.
pub struct Subject {
    pub config: ExperimentConfig,
    pub model: Box<dyn Generator>,
    /// What to call it in the output.
    pub what: String,
    /// The run's folder; none for a config.
    pub run: Option<RunFolder>,
    /// What is known of its training; none for a config.
    pub manifest: Option<Manifest>,
    /// SHA-256 of the file of its weights; none without one.
    pub weights: Option<String>,
}

/// Refuses a config that differs from the run's in what the run's model was trained with.
fn check_trained_values(run: &RunFolder, config: &ExperimentConfig) -> Result<(), RunError> {
    let trained = run.config()?;
    if trained.model.untrained(&trained.data).is_some() {
        return Ok(());
    }
    let own = trained.model.tables().map_err(ConfigError::from)?;
    let mut differences = trained.training_differences(config)?;
    differences.retain(|difference| {
        let table = difference.split(['.', ':']).next();
        table.is_some_and(|table| own.contains_key(table))
    });
    match &differences[..] {
        [] => Ok(()),
        _ => Err(RunError::Refused(format!(
            "{} holds a trained model: its size, and what else it was trained with, cannot be \
             changed any more ({}; values there, values now); leave these --set out, or train \
             another model with them",
            run.newest_weights()?.display(),
            differences.join("; ")
        ))),
    }
}

impl Subject {
    /// Opens a run's folder, or the config of a model that needs no training; `set` overrides keys
    /// of the config.
    ///
    /// # Errors
    /// There is no such run or config, its model is not trained, or its weights are damaged; `set`
    /// overrides what a run's model was trained with.
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
        if let Some(run) = run.as_ref().filter(|_| !set.is_empty()) {
            check_trained_values(run, &config)?;
        }
        let mut weights = None;
        let (model, source) = match (config.model.untrained(&config.data), &run) {
            (Some(model), _) => (model, format!(" of {path}")),
            (None, Some(run)) => {
                let saved = run.saved_weights(&config)?;
                let model = run.model_of(&config, &saved)?;
                weights = Some(saved.digest);
                (model, format!(", {}", saved.path.display()))
            }
            (None, None) => {
                return Err(RunError::Refused(format!(
                    "{path} describes a model that is trained; train it with `keydance train \
                     {path} --data DIR --out RUN_DIR` and give RUN_DIR instead"
                )));
            }
        };
        let manifest = run.as_ref().map(RunFolder::manifest).transpose()?.flatten();
        Ok(Self {
            what: format!("{}{source}", config.name),
            config,
            model,
            run,
            manifest,
            weights,
        })
    }

    /// The files that it is read from.
    pub fn files(&self) -> Vec<PathBuf> {
        let parts = self.run.iter().flat_map(RunFolder::parts);
        parts.chain(self.config.files.iter().cloned()).collect()
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
        if self.manifest.is_none() && self.weights.is_some() {
            return Err(RunError::Refused(format!(
                "{} has no manifest.json, which says what data it was trained on; put it back, or \
                 give --other-data",
                run.path().display()
            )));
        }
        if let Some(manifest) = &self.manifest
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

    /// Refuses a file that would be a clip in the folder that the run was trained on: with it the
    /// folder is other data.
    ///
    /// # Errors
    /// It would be.
    pub fn check_no_clip(&self, file: &Path) -> Result<(), RunError> {
        let place = place(file);
        let folder = place.parent().filter(|_| is_clip(file));
        match folder.zip(self.manifest.as_ref()) {
            Some((folder, manifest))
                if Dataset::digest_of(folder).as_ref() == Some(&manifest.data_digest) =>
            {
                Err(RunError::Refused(format!(
                    "{} would be one of the clips that {} was trained on; give a file elsewhere",
                    file.display(),
                    manifest.name
                )))
            }
            _ => Ok(()),
        }
    }

    /// The folder for scores on `data`: the run's, or `out` for a config. None where there is
    /// neither, or where the run has scores on other clips, which it keeps without `force`.
    ///
    /// # Errors
    /// `out` is given for a run or holds another config; without `force`: scores on other clips, or
    /// other files.
    pub fn scores_folder<'a>(
        &'a self,
        out: Option<&'a Path>,
        data: &EvaluatedData,
        force: bool,
    ) -> Result<Option<&'a Path>, RunError> {
        let refused = |folder: &Path, problem: String| {
            Err(RunError::Refused(format!("{} {problem}", folder.display())))
        };
        let keeps = |folder: &&Path| force || !EvaluationRecord::is_of_other_clips(folder, data);
        let Some(folder) = out else {
            return Ok(self.run.as_ref().map(RunFolder::path).filter(keeps));
        };
        if let Some(run) = &self.run {
            let problem = "is a run's folder and keeps its scores itself; --out is for a config";
            return refused(run.path(), problem.into());
        }
        let earlier = RunFolder::open(folder);
        if !earlier.config_path().exists() {
            check_output_folder(folder, force)?;
            return Ok(out);
        }
        let differences = earlier.config()?.differences(&self.config)?;
        if !differences.is_empty() {
            let problem = format!(
                "holds scores of another config ({}); values there, values now; give another --out",
                differences.join("; ")
            );
            return refused(folder, problem);
        }
        match keeps(&folder) {
            true => Ok(out),
            false => refused(
                folder,
                "holds scores on other clips; give another --out, or --force to replace them"
                    .into(),
            ),
        }
    }

    /// Writes scores into the [folder for them](Subject::scores_folder); for a config it is made,
    /// with the config in it.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write_scores(&self, folder: &Path, record: &EvaluationRecord) -> Result<(), RunError> {
        if self.run.is_none() {
            std::fs::create_dir_all(folder).map_err(FileError::at(folder, "created"))?;
            RunFolder::open(folder).write_config(&self.config)?;
        }
        Ok(record.write(folder)?)
    }
}

//! Runs' folders that `keydance evaluate` has been through, side by side.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ExperimentConfig, ReproduceError};
use crate::evaluation::{EvaluationRecord, TableRow};
use crate::report::{NO_TRAINING, schedule_note};
use crate::run::{Manifest, RunFolder};

/// A run with its scores.
pub struct EvaluatedRun {
    folder: PathBuf,
    pub config: ExperimentConfig,
    /// None where nothing was trained.
    manifest: Option<Manifest>,
    pub record: EvaluationRecord,
}

impl EvaluatedRun {
    /// The runs of folders that were evaluated on the same clips.
    ///
    /// # Errors
    /// A folder has no scores, a file of it is damaged, or the scores are of different data.
    pub fn read_all(folders: &[PathBuf]) -> Result<Vec<Self>, ReproduceError> {
        let runs = folders.iter().map(|folder| Self::read(folder));
        let runs: Vec<Self> = runs.collect::<Result<_, _>>()?;
        for pair in runs.windows(2) {
            let [ours, theirs] = [&pair[0], &pair[1]].map(Self::measured);
            // Scores stand side by side only if they were measured on the same windows.
            if ours != theirs {
                return Err(ReproduceError::Refused(format!(
                    "scores of different data do not stand in one table: {} {ours}, but {} {theirs}",
                    pair[0].folder.display(),
                    pair[1].folder.display()
                )));
            }
        }
        Ok(runs)
    }

    fn read(folder: &Path) -> Result<Self, ReproduceError> {
        let run = RunFolder::open(folder);
        let record = EvaluationRecord::read(folder)?;
        Ok(Self {
            config: run.config_of_weights()?,
            manifest: run.manifest()?,
            record,
            folder: folder.into(),
        })
    }

    /// Its row in the tables.
    pub fn row(&self) -> TableRow {
        TableRow {
            name: self.config.name.clone(),
            seed: self.manifest.as_ref().map(|manifest| manifest.seed),
            scores: Some(self.record.scores.clone()),
            schedule_note: match &self.manifest {
                Some(manifest) => schedule_note(&self.config, manifest),
                None => NO_TRAINING.into(),
            },
        }
    }

    /// On what, in words.
    fn measured(&self) -> String {
        let data = &self.record.data;
        let windows: BTreeMap<_, _> = self.record.scores.windows().iter().cloned().collect();
        format!(
            "on {} test clips ({} frames, windows by length {windows:?}) of data with digest {}",
            data.clips, data.frames, data.data_digest
        )
    }
}

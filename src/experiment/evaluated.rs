//! Runs' folders that `keydance evaluate` has been through, side by side.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{ExperimentConfig, ReproduceError};
use crate::counted::counted;
use crate::data::Dataset;
use crate::evaluation::{EvaluationRecord, TableRow, Tables};
use crate::report::{NO_TRAINING, schedule_note};
use crate::run::{FileError, Manifest, RunFolder};

/// A run with its scores.
pub struct EvaluatedRun {
    folder: PathBuf,
    config: ExperimentConfig,
    /// None where nothing was trained.
    manifest: Option<Manifest>,
    record: EvaluationRecord,
}

impl EvaluatedRun {
    /// The tables of the runs of folders, Markdown, beside what the first one's paper prints.
    ///
    /// # Errors
    /// A folder has no scores, a file of it is damaged, or the scores are of different data; there
    /// are no folders.
    pub fn tables(folders: &[PathBuf]) -> Result<String, ReproduceError> {
        let runs = Self::read_all(folders)?;
        let rows: Vec<TableRow> = runs.iter().map(Self::row).collect();
        let none = || ReproduceError::Refused("no run was given".into());
        let Self { config, record, .. } = runs.first().ok_or_else(none)?;
        let (protocols, printed) = (&config.protocols(), &config.printed()?);
        Ok(Tables { protocols, printed }.markdown(&rows, &record.data.caption()))
    }

    /// The runs of folders that were evaluated on the same clips.
    fn read_all(folders: &[PathBuf]) -> Result<Vec<Self>, ReproduceError> {
        let runs = folders.iter().map(|folder| Self::read(folder));
        let runs: Vec<Self> = runs.collect::<Result<_, _>>()?;
        for pair in runs.windows(2) {
            let [ours, theirs] = [pair[0].measured(&pair[1]), pair[1].measured(&pair[0])];
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

    /// Rows of the tables from a folder, by their folders' names: all that have scores there, such
    /// as `keydance reproduce` wrote; on `data` where it is given.
    ///
    /// # Errors
    /// There is none; as [`EvaluatedRun::tables`]; they were scored on other data.
    pub fn rows_in(folder: &Path, data: Option<&Dataset>) -> Result<Vec<TableRow>, ReproduceError> {
        let entries = std::fs::read_dir(folder).map_err(FileError::at(folder, "read"))?;
        let mut folders: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| path.join(RunFolder::CONFIG).is_file() && EvaluationRecord::is_in(path))
            .collect();
        if folders.is_empty() {
            return Err(ReproduceError::Refused(format!(
                "{} holds no folder of a row with its scores; `keydance reproduce` writes such a \
                 folder",
                folder.display()
            )));
        }
        folders.sort_unstable();
        let runs = Self::read_all(&folders)?;
        let scored = runs.first().map(|run| &run.record.data.data_digest);
        if let Some((scored, data)) = scored.zip(data)
            && *scored != data.digest
        {
            return Err(ReproduceError::Refused(format!(
                "{} holds scores on data with digest {scored}, that of --data is {}; give \
                 --other-data to show them all the same",
                folder.display(),
                data.digest
            )));
        }
        Ok(runs.iter().map(Self::row).collect())
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
    fn row(&self) -> TableRow {
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

    /// On what, in words; by the protocols that both were scored by.
    fn measured(&self, other: &Self) -> String {
        let data = &self.record.data;
        let scores = self.record.scores.iter();
        let shared = scores.filter(|(protocol, _)| other.record.scores.by(protocol).is_some());
        let windows = shared.map(|(protocol, scores)| {
            let by_length: BTreeMap<_, _> = scores.windows().iter().cloned().collect();
            let by_length = by_length.iter();
            let by_length = by_length.map(|(length, windows)| format!("{length}: {windows}"));
            format!("{} by {protocol}", by_length.collect::<Vec<_>>().join(", "))
        });
        let windows = windows.collect::<Vec<_>>().join(", ");
        format!(
            "on {}{} ({} frames, windows by length {windows}) of data with digest {}",
            data.windows(),
            counted(data.clips, "test clip"),
            data.frames,
            data.data_digest
        )
    }
}

//! The results of a row: a small folder beside the tables, from which they can be made again
//! without the run.

use std::path::{Path, PathBuf};

use super::ReproduceError;
use super::rows::Row;
use crate::data::{DataPart, Dataset};
use crate::evaluation::scores::AVERAGE;
use crate::evaluation::{EvaluatedData, EvaluationRecord, Scores, TableRow};
use crate::report::{
    LossSeries, NO_TRAINING, ValidationSeries, loss_curve, schedule_note, thousands,
    validation_curve,
};
use crate::run::{FileError, LogLine, Manifest, RunFolder, RunState, replace_file};

const LOSS_CURVE: &str = "loss_curve.svg";
const VALIDATION_CURVE: &str = "validation_curve.svg";

/// What became of a row: its folder in `--out`, which holds config, manifest, scores and figures.
pub struct RowResults {
    folder: RunFolder,
}

impl RowResults {
    pub fn of(row: &Row, out: &Path) -> Self {
        Self {
            folder: RunFolder::open(&out.join(&row.folder)),
        }
    }

    /// The scores, if the row is done.
    ///
    /// # Errors
    /// The folder holds results of another config or other data (both are named), or a file of it
    /// is damaged.
    pub fn read(
        &self,
        row: &Row,
        dataset: &Dataset,
    ) -> Result<Option<EvaluationRecord>, ReproduceError> {
        let path = self.folder.path();
        if !self.folder.config_path().exists() {
            return Ok(None);
        }
        let differences = self.folder.config()?.differences(&row.config)?;
        if !differences.is_empty() {
            return Err(ReproduceError::OtherConfig {
                folder: path.into(),
                differences,
            });
        }
        let [scores, _] = EvaluationRecord::files(DataPart::Test);
        if !path.join(scores).exists() {
            return Ok(None);
        }
        let record = EvaluationRecord::read(path)?;
        if record.data.data_digest != dataset.digest {
            return Err(ReproduceError::OtherData {
                folder: path.into(),
                saved: record.data.data_digest,
                found: dataset.digest.clone(),
            });
        }
        Ok(Some(record))
    }

    /// The manifest of the training.
    ///
    /// # Errors
    /// It is damaged.
    pub fn manifest(&self) -> Result<Option<Manifest>, ReproduceError> {
        Ok(self.folder.manifest()?)
    }

    /// Writes a row's results; the scores last, so that a row with scores is whole.
    ///
    /// # Errors
    /// A file cannot be read or written, or the losses cannot be drawn.
    pub fn write(
        &self,
        row: &Row,
        run: Option<&RunFolder>,
        scores: Scores,
        dataset: &Dataset,
    ) -> Result<(), ReproduceError> {
        let path = self.folder.path();
        std::fs::create_dir_all(path).map_err(FileError::at(path, "created"))?;
        replace_file(&self.folder.config_path(), row.config.to_toml()?.as_bytes())?;
        if let Some(run) = run {
            let manifest = run.manifest_path();
            let content = std::fs::read(&manifest).map_err(FileError::at(&manifest, "read"))?;
            replace_file(&self.folder.manifest_path(), &content)?;
            self.write_curves(row, &run.log()?)?;
        }
        let data = EvaluatedData::of(dataset, DataPart::Test)?;
        Ok(EvaluationRecord { scores, data }.write(path)?)
    }

    fn write_curves(&self, row: &Row, log: &[LogLine]) -> Result<(), ReproduceError> {
        let Some(last) = log.last() else {
            return Ok(());
        };
        let title = |what: &str| {
            let frame_steps = thousands(last.frame_steps);
            format!("{what} of {}, {frame_steps} frame-steps", row.folder)
        };
        let write = |name: &str, svg: String| -> Result<(), ReproduceError> {
            Ok(replace_file(
                &self.folder.path().join(name),
                svg.as_bytes(),
            )?)
        };
        let losses = |name: &str, of: &dyn Fn(&LogLine) -> Option<f64>| LossSeries {
            name: name.into(),
            points: log
                .iter()
                .filter_map(|line| Some((line.frame_steps as f64, of(line)?)))
                .collect(),
        };
        let mut series = vec![losses("total", &|line| Some(line.total))];
        for name in last.losses.keys() {
            series.push(losses(name, &|line| line.losses.get(name).copied()));
        }
        write(LOSS_CURVE, loss_curve(&title("Losses"), &series)?)?;
        let scored: Vec<(f64, &Scores)> = log
            .iter()
            .filter_map(|line| Some((line.frame_steps as f64, line.validation.as_ref()?)))
            .collect();
        let Some((_, last)) = scored.last() else {
            return Ok(());
        };
        let protocol = row.config.protocol();
        let Some((metric, row)) = protocol
            .metrics()
            .iter()
            .find_map(|metric| Some((metric, last.row(metric.key)?)))
        else {
            return Ok(());
        };
        let columns = row.columns().filter(|column| *column != AVERAGE);
        let by_column: Vec<ValidationSeries> = columns
            .map(|column| ValidationSeries {
                column: column.into(),
                points: scored
                    .iter()
                    .filter_map(|(frame_steps, scores)| {
                        Some((*frame_steps, scores.row(metric.key)?.at(column)?))
                    })
                    .collect(),
            })
            .collect();
        let title = title(&format!("{} on validation clips", metric.title));
        let curve = validation_curve(&title, metric, &by_column)?;
        write(VALIDATION_CURVE, curve)
    }

    /// Files that are there, by their names.
    pub fn files(&self) -> Vec<PathBuf> {
        let [scores, data] = EvaluationRecord::files(DataPart::Test);
        let own =
            [scores, data, LOSS_CURVE, VALIDATION_CURVE].map(|name| self.folder.path().join(name));
        [self.folder.config_path(), self.folder.manifest_path()]
            .into_iter()
            .chain(own)
            .filter(|path| path.exists())
            .collect()
    }
}

/// The row in the tables: with its scores, or with why it has none.
///
/// # Errors
/// A file of the results or of the run is damaged.
pub fn table_row(
    row: &Row,
    record: Option<&EvaluationRecord>,
    results: &RowResults,
    run: &RunFolder,
) -> Result<TableRow, ReproduceError> {
    let manifest = match record {
        Some(_) => results.manifest()?,
        None => run.manifest()?,
    };
    let note = match (&manifest, record) {
        _ if !row.is_trained() => NO_TRAINING.into(),
        (None, _) => "not trained yet".into(),
        (Some(manifest), None) if manifest.state == RunState::Diverged => format!(
            "diverged: a loss or gradient was not finite after step {} of {}",
            manifest.steps_done, manifest.steps
        ),
        (Some(manifest), None) if manifest.state == RunState::Finished => {
            "trained, but not evaluated yet".into()
        }
        (Some(manifest), None) => format!(
            "not trained yet: {} of {} steps at the last checkpoint",
            manifest.steps_done, manifest.steps
        ),
        (Some(manifest), Some(_)) => schedule_note(&row.config, manifest),
    };
    Ok(TableRow {
        name: row.config.name.clone(),
        seed: row.is_trained().then_some(row.config.seed),
        scores: record.map(|record| record.scores.clone()),
        schedule_note: note,
    })
}

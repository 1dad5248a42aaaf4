//! The results of a row: a small folder beside the tables, from which they can be made again
//! without the run.

use std::path::{Path, PathBuf};

use super::ReproduceError;
use super::rows::Row;
use crate::data::{DataPart, Dataset};
use crate::evaluation::scores::AVERAGE;
use crate::evaluation::{EvaluatedData, EvaluationRecord, ProtocolScores};
use crate::report::{LossSeries, loss_curve, thousands, validation_curve};
use crate::run::{FileError, LogLine, RunFolder, replace_file};

const LOSS_CURVE: &str = "loss_curve.svg";
/// How results that are in the way are made again.
const REMEDY: &str = "remove that folder to make it again, or give another --out";
const VALIDATION_CURVE: &str = "validation_curve.svg";

/// What became of a row: its folder in `--out`, which holds config, manifest, scores and figures.
pub struct RowResults {
    pub folder: RunFolder,
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
            return Err(ReproduceError::Refused(format!(
                "{} holds results of another config ({}; values there, values now); {REMEDY}",
                path.display(),
                differences.join("; ")
            )));
        }
        if !EvaluationRecord::is_in(path) {
            return Ok(None);
        }
        let record = EvaluationRecord::read(path)?;
        if record.data.data_digest != dataset.digest {
            return Err(ReproduceError::Refused(format!(
                "{} holds results on data with digest {}, the data folder has digest {}; {REMEDY}",
                path.display(),
                record.data.data_digest,
                dataset.digest
            )));
        }
        Ok(Some(record))
    }

    /// Writes a row's results; the scores last, so that a row with scores is whole.
    ///
    /// # Errors
    /// A file cannot be read or written, or the losses cannot be drawn.
    pub fn write(
        &self,
        row: &Row,
        run: Option<&RunFolder>,
        scores: ProtocolScores,
        dataset: &Dataset,
    ) -> Result<(), ReproduceError> {
        let path = self.folder.path();
        std::fs::create_dir_all(path).map_err(FileError::at(path, "created"))?;
        self.folder.write_config(&row.config)?;
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
        let points = |of: &dyn Fn(&LogLine) -> Option<f64>| -> Vec<(f64, f64)> {
            let point = |line: &LogLine| Some((line.frame_steps as f64, of(line)?));
            log.iter().filter_map(point).collect()
        };
        let mut series = vec![LossSeries {
            name: "total".into(),
            points: points(&|line| Some(line.total)),
        }];
        series.extend(last.losses.keys().map(|name| LossSeries {
            name: name.clone(),
            points: points(&|line| line.losses.get(name).copied()),
        }));
        let path = self.folder.path();
        let losses = loss_curve(&title("Losses"), &series)?;
        replace_file(&path.join(LOSS_CURVE), losses)?;
        let mut scored = log.iter().rev().filter_map(|line| line.validation.as_ref());
        let Some(scores) = scored.next() else {
            return Ok(());
        };
        let protocols = row.config.protocols();
        let mut metrics = protocols.iter().flat_map(|protocol| protocol.metrics());
        let found = metrics.find_map(|metric| Some((metric, scores.row(metric.key)?)));
        let Some((metric, row)) = found else {
            return Ok(());
        };
        let columns = row.columns().filter(|column| *column != AVERAGE);
        let score =
            |line: &LogLine, column: &str| line.validation.as_ref()?.row(metric.key)?.at(column);
        let series = columns.map(|column| (column, points(&|line| score(line, column))));
        let title = title(&format!("{} on validation clips", metric.title));
        let curve = validation_curve(&title, metric, series.collect())?;
        Ok(replace_file(&path.join(VALIDATION_CURVE), curve)?)
    }

    /// Files that are there, by their names.
    pub fn files(&self) -> Vec<PathBuf> {
        let [scores, data] = EvaluationRecord::files(DataPart::Test);
        let own = [scores, data, LOSS_CURVE, VALIDATION_CURVE];
        let mut files = vec![self.folder.config_path(), self.folder.manifest_path()];
        files.extend(own.map(|name| self.folder.path().join(name)));
        files.retain(|path| path.exists());
        files
    }
}

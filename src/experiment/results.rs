//! The results of a row: a small folder beside the tables, from which they can be made again
//! without the run.

use std::path::{Path, PathBuf};

use super::ReproduceError;
use super::curves::Curves;
use super::rows::Row;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{EvaluatedData, EvaluationRecord, ProtocolScores};
use crate::run::{FileError, RunFolder, replace_file};

/// How results that are in the way are made again.
const REMEDY: &str = "remove that folder to make it again, or give another --out";

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
            let log = run.log()?;
            if !log.is_empty() {
                Curves::of(&row.folder, &row.config, log).write(path, &Curves::OF_ROW)?;
            }
        }
        let manifest = run.map(RunFolder::manifest).transpose()?.flatten();
        let weights = manifest.and_then(|it| it.weights_file_digest);
        let data = EvaluatedData::of(dataset, DataPart::Test, weights)?;
        Ok(EvaluationRecord { scores, data }.write(path)?)
    }

    /// Files that are there, by their names.
    pub fn files(&self) -> Vec<PathBuf> {
        let [scores, data] = EvaluationRecord::files(DataPart::Test);
        let own = [scores, data].into_iter().chain(Curves::OF_ROW);
        let mut files = vec![self.folder.config_path(), self.folder.manifest_path()];
        files.extend(own.map(|name| self.folder.path().join(name)));
        files.retain(|path| path.exists());
        files
    }
}

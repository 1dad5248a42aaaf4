//! What `keydance reproduce` writes beside the rows: tables, a figure of the first metric, and a
//! manifest of everything.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::Value;

use super::results::RowResults;
use super::rows::Row;
use super::{ReproduceError, Reproduction};
use crate::data::file_digest;
use crate::evaluation::{EvaluationRecord, TableRow, Tables};
use crate::report::{NO_TRAINING, schedule_note, score_figure};
use crate::run::{
    FileError, Manifest, RunFolder, RunState, check_output_folder, replace_file, write_json,
};

const TABLES: &str = "tables.md";
const MANIFEST: &str = "manifest.json";

/// A row with what there is of it.
struct Reported<'r> {
    row: &'r Row,
    record: Option<EvaluationRecord>,
    results: RowResults,
    /// Of the training whose scores there are; without scores, of the training as far as it is.
    manifest: Option<Manifest>,
}

/// `manifest.json` of all results.
#[derive(Serialize)]
struct ResultsManifest<'r> {
    /// Digest of the data that all rows were trained and evaluated on.
    data_digest: &'r str,
    /// Version of keydance that wrote this, and its commit where it was built in a git checkout.
    version: &'static str,
    commit: Option<&'static str>,
    rows: Vec<ManifestRow<'r>>,
    /// SHA-256 of every file, hexadecimal, by its path in the folder.
    files: BTreeMap<String, String>,
}

#[derive(Serialize)]
struct ManifestRow<'r> {
    name: &'r str,
    folder: &'r str,
    seed: u64,
    /// Trained, where there is anything to train, and evaluated.
    done: bool,
    note: &'r str,
    /// Of the training, as in the row's own manifest.
    seconds: Option<f64>,
    weights_digest: Option<&'r str>,
    commit: Option<&'r str>,
}

impl Reproduction<'_> {
    /// Refuses a folder for the results that holds others: tables and manifest would replace what
    /// is there.
    ///
    /// # Errors
    /// It is a run's, or holds results of another config; without `force`: it holds rows that are
    /// not of this table, or files but no row of it.
    pub fn check_out(&self, force: bool) -> Result<(), ReproduceError> {
        let out = self.out.display();
        let refused = |problem| Err(ReproduceError::Refused(format!("{out} {problem}")));
        if self.out.join(RunFolder::CONFIG).exists() {
            return refused("is a run's folder; give another --out".into());
        }
        for row in self.rows {
            RowResults::of(row, self.out).read(row, self.dataset)?;
        }
        if force {
            return Ok(());
        }
        let is_own = |folder: &str| self.rows.iter().any(|row| row.folder == folder);
        let Ok(text) = std::fs::read_to_string(self.out.join(MANIFEST)) else {
            // Stopped before its first tables, or not begun.
            let begun = |row: &Row| self.out.join(&row.folder).exists();
            return match self.rows.iter().any(begun) {
                true => Ok(()),
                false => Ok(check_output_folder(self.out, false)?),
            };
        };
        let manifest = serde_json::from_str(&text).unwrap_or(Value::Null);
        let is_other = |row: &&Value| {
            let folder = row["folder"].as_str();
            row["done"] == true && folder.is_some_and(|folder| !is_own(folder))
        };
        let Some(rows) = manifest["rows"].as_array() else {
            return refused(format!(
                "has a {MANIFEST} that is not of tables; give another --out, or --force"
            ));
        };
        match rows.iter().find(is_other) {
            None => Ok(()),
            Some(row) => refused(format!(
                "holds tables with a row {}, which this command would leave out; give the configs \
                 and --seeds of then, another --out, or --force",
                row["folder"]
            )),
        }
    }

    /// Writes tables, figures and manifest anew from what the rows have.
    ///
    /// # Errors
    /// A file cannot be read or written.
    pub(super) fn report(&self) -> Result<(), ReproduceError> {
        if !self.tables {
            return Ok(());
        }
        let reported = self.rows.iter().map(|row| self.reported(row));
        let rows: Vec<Reported<'_>> = reported.collect::<Result<_, _>>()?;
        let Some(record) = rows.iter().find_map(|reported| reported.record.as_ref()) else {
            return Ok(());
        };
        let table_rows: Vec<TableRow> = rows.iter().map(Reported::table_row).collect();
        let (out, printed) = (self.out, self.printed);
        let protocols = &rows[0].row.config.protocols();
        let text = Tables { protocols, printed }.markdown(&table_rows, &record.data.caption());
        let mut files: Vec<PathBuf> = vec![out.join(TABLES)];
        replace_file(&files[0], text)?;
        let mut compared = protocols.iter();
        if let Some(protocol) = compared.find(|protocol| printed.compares(protocol.name()))
            && let Some(metric) = protocol.metrics().first()
            && let Some(drawn) = score_figure(protocol.name(), metric, printed, &table_rows)?
        {
            let figure = out.join(metric.key).with_extension("svg");
            replace_file(&figure, drawn)?;
            files.push(figure);
        }
        files.extend(rows.iter().flat_map(|reported| reported.results.files()));
        let manifest_rows = rows.iter().zip(&table_rows);
        let manifest = ResultsManifest {
            data_digest: &self.dataset.digest,
            version: env!("CARGO_PKG_VERSION"),
            commit: option_env!("KEYDANCE_COMMIT"),
            rows: manifest_rows
                .map(|(reported, table_row)| reported.manifest_row(table_row))
                .collect(),
            files: digests(out, &files)?,
        };
        Ok(write_json(&out.join(MANIFEST), &manifest)?)
    }

    fn reported<'r>(&self, row: &'r Row) -> Result<Reported<'r>, ReproduceError> {
        let results = RowResults::of(row, self.out);
        let record = results.read(row, self.dataset)?;
        let manifest = match record {
            Some(_) => results.folder.manifest()?,
            None => self.run_of(row)?.manifest()?,
        };
        Ok(Reported {
            row,
            record,
            results,
            manifest,
        })
    }
}

impl Reported<'_> {
    /// The row in the tables: with its scores, or with why it has none.
    fn table_row(&self) -> TableRow {
        let config = &self.row.config;
        let note = match (&self.manifest, &self.record) {
            _ if !self.row.is_trained() => NO_TRAINING.into(),
            (None, _) => "not trained yet".into(),
            (Some(manifest), Some(_)) => schedule_note(config, manifest),
            (Some(manifest), None) => {
                let (done, steps) = (manifest.steps_done, manifest.steps);
                match manifest.state {
                    RunState::Diverged => format!(
                        "diverged: a loss or gradient was not finite after step {done} of {steps}"
                    ),
                    RunState::Finished => "trained, but not evaluated yet".into(),
                    _ => format!("not trained yet: {done} of {steps} steps at the last checkpoint"),
                }
            }
        };
        TableRow {
            name: config.name.clone(),
            seed: self.row.is_trained().then_some(config.seed),
            scores: self.record.as_ref().map(|record| record.scores.clone()),
            schedule_note: note,
        }
    }

    fn manifest_row<'r>(&'r self, table_row: &'r TableRow) -> ManifestRow<'r> {
        let done = self.record.is_some();
        let training = self.manifest.as_ref().filter(|_| done);
        let config = &self.row.config;
        ManifestRow {
            name: &config.name,
            folder: &self.row.folder,
            seed: config.seed,
            done,
            note: &table_row.schedule_note,
            seconds: training.map(|training| training.seconds),
            weights_digest: training.and_then(|training| training.weights_digest.as_deref()),
            commit: training.and_then(|training| training.commit.as_deref()),
        }
    }
}

fn digests(out: &Path, files: &[PathBuf]) -> Result<BTreeMap<String, String>, FileError> {
    let digest = |path: &PathBuf| {
        let content = std::fs::read(path).map_err(FileError::at(path, "read"))?;
        let name = path.strip_prefix(out).unwrap_or(path);
        let name: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        Ok((name.join("/"), file_digest(&content)))
    };
    files.iter().map(digest).collect()
}

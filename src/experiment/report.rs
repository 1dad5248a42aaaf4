//! What `keydance reproduce` writes beside the rows: tables, a figure of the first metric, and a manifest of everything.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest as _, Sha256};

use super::ReproduceError;
use super::results::{RowResults, table_row};
use super::rows::Row;
use crate::data::hexadecimal;
use crate::evaluation::{EvaluationRecord, PrintedTables, TableRow, Tables};
use crate::report::score_figure;
use crate::run::{FileError, RunFolder, replace_file, write_json};

const TABLES: &str = "tables.md";
const MANIFEST: &str = "manifest.json";

/// A row with what there is of it.
pub struct Reported<'r> {
    pub row: &'r Row,
    pub record: Option<EvaluationRecord>,
    pub results: RowResults,
    pub run: RunFolder,
}

/// `manifest.json` of all results.
#[derive(Serialize)]
struct Manifest<'r> {
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
    note: String,
    /// Of the training, as in the row's own manifest.
    seconds: Option<f64>,
    weights_digest: Option<String>,
    commit: Option<String>,
}

/// Writes everything anew from what the rows have.
///
/// # Errors
/// A file cannot be read or written.
pub fn write(
    out: &Path,
    rows: &[Reported<'_>],
    printed: &PrintedTables,
    data_digest: &str,
) -> Result<(), ReproduceError> {
    let table_rows: Vec<TableRow> = rows
        .iter()
        .map(|reported| {
            let Reported {
                row,
                record,
                results,
                run,
            } = reported;
            table_row(row, record.as_ref(), results, run)
        })
        .collect::<Result<_, ReproduceError>>()?;
    let Some(record) = rows.iter().find_map(|reported| reported.record.as_ref()) else {
        return Ok(());
    };
    let protocol = rows[0].row.config.protocol();
    let tables = Tables {
        metrics: protocol.metrics(),
        printed,
    };
    let text = tables.markdown(&table_rows, &record.data.caption());
    let mut files: Vec<PathBuf> = vec![out.join(TABLES)];
    replace_file(&files[0], text.as_bytes())?;
    if let Some(metric) = protocol.metrics().first()
        && let Some(drawn) = score_figure(metric, printed, &table_rows)?
    {
        let figure = out.join(metric.key).with_extension("svg");
        replace_file(&figure, drawn.as_bytes())?;
        files.push(figure);
    }
    files.extend(rows.iter().flat_map(|reported| reported.results.files()));
    let manifest = Manifest {
        data_digest,
        version: env!("CARGO_PKG_VERSION"),
        commit: option_env!("KEYDANCE_COMMIT"),
        rows: rows
            .iter()
            .zip(&table_rows)
            .map(|(reported, table_row)| manifest_row(reported, table_row))
            .collect::<Result<_, ReproduceError>>()?,
        files: digests(out, &files)?,
    };
    Ok(write_json(&out.join(MANIFEST), &manifest)?)
}

fn manifest_row<'r>(
    reported: &Reported<'r>,
    table_row: &TableRow,
) -> Result<ManifestRow<'r>, ReproduceError> {
    let training = match reported.record {
        Some(_) => reported.results.manifest()?,
        None => None,
    };
    let config = &reported.row.config;
    Ok(ManifestRow {
        name: &config.name,
        folder: &reported.row.folder,
        seed: config.seed,
        done: reported.record.is_some(),
        note: table_row.schedule_note.clone(),
        seconds: training.as_ref().map(|training| training.seconds),
        weights_digest: training
            .as_ref()
            .and_then(|training| training.weights_digest.clone()),
        commit: training.and_then(|training| training.commit),
    })
}

fn digests(out: &Path, files: &[PathBuf]) -> Result<BTreeMap<String, String>, FileError> {
    let digest = |path: &PathBuf| {
        let content = std::fs::read(path).map_err(FileError::at(path, "read"))?;
        let name = path.strip_prefix(out).unwrap_or(path);
        let name: Vec<_> = name.iter().map(|part| part.to_string_lossy()).collect();
        Ok((name.join("/"), hexadecimal(&Sha256::digest(&content))))
    };
    files.iter().map(digest).collect()
}

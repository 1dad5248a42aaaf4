//! The rows of a table: the configs of a folder, under one budget, with their seeds.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::{ExperimentConfig, ReproduceError};
use crate::data::Dataset;
use crate::evaluation::PrintedTables;

/// A model, trained from one seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub config: ExperimentConfig,
    /// Name of its folders: the config's, with the seed where it is not the config's own.
    pub folder: String,
}

impl Row {
    /// Whether it has weights to train.
    pub fn is_trained(&self) -> bool {
        self.config.model.untrained(&self.config.data).is_none()
    }
}

/// Seeds that a model is trained from, instead of its config's one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    pub name: String,
    pub seeds: Vec<u64>,
}

impl FromStr for Seeds {
    type Err = String;

    /// From "NAME=SEED,SEED,..".
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected NAME=SEED,SEED,..., such as mine=1,2,3".to_string();
        let (name, list) = text.split_once('=').ok_or_else(expected)?;
        let seeds = list.split(',').map(|seed| seed.trim().parse().ok());
        let seeds: Vec<u64> = seeds.collect::<Option<_>>().ok_or_else(expected)?;
        if seeds.iter().collect::<BTreeSet<_>>().len() != seeds.len() {
            return Err(format!("names a seed twice; {}", expected()));
        }
        Ok(Self {
            name: name.trim().into(),
            seeds,
        })
    }
}

/// The file of a folder of configs that holds what the paper prints.
const PRINTED: &str = "paper.toml";

/// All rows of a folder of configs, and what the paper prints: first every model once, in the
/// paper's order and then by name, then further seeds.
///
/// Where `only` names some rows, `sets` reach the others as far as they know the key.
///
/// # Errors
/// The folder holds no config, one is bad, two have the same name, or seeds are given for a model
/// that is not there.
pub fn read(
    folder: &Path,
    budget: Option<&Path>,
    sets: &[String],
    only: &[String],
    seeds: &[Seeds],
) -> Result<(Vec<Row>, PrintedTables), ReproduceError> {
    let mut configs: Vec<ExperimentConfig> = Vec::new();
    for file in files(folder)? {
        let load = |sets: &[String]| {
            let config = ExperimentConfig::load_under(&file, budget, sets);
            config.map_err(|source| ReproduceError::NoRow {
                file: file.clone(),
                source: source.into(),
            })
        };
        let name = load(&[])?.name;
        let chosen = only.is_empty() || only.contains(&name);
        let known = |set: &&String| chosen || load(std::slice::from_ref(*set)).is_ok();
        let config = load(&sets.iter().filter(known).cloned().collect::<Vec<_>>())?;
        if configs.iter().any(|other| other.name == config.name) {
            return Err(ReproduceError::Refused(format!(
                "two configs in {} are called {name}; give each a name of its own",
                folder.display()
            )));
        }
        configs.push(config);
    }
    let printed = match std::fs::read_to_string(folder.join(PRINTED)) {
        Ok(text) => PrintedTables::parse(&text, &folder.join(PRINTED).display().to_string())?,
        Err(_) => configs[0].printed()?,
    };
    let place = |name: &str| printed.rows.iter().position(|row| row.name == name);
    configs.sort_by_cached_key(|config| {
        let name = config.name.clone();
        (place(&name).unwrap_or(usize::MAX), name)
    });
    if let Some(budget) = budget {
        let budgeted = ExperimentConfig::rows_of_budget(budget);
        let flag = format!("--budget {}: rows", budget.display());
        for name in budgeted? {
            known(&configs, &name, &flag, folder)?;
        }
    }
    for (index, Seeds { name, .. }) in seeds.iter().enumerate() {
        known(&configs, name, "--seeds", folder)?;
        if seeds[..index].iter().any(|other| other.name == *name) {
            return Err(ReproduceError::Refused(format!(
                "--seeds names {name} twice; give all its seeds in one list"
            )));
        }
    }
    let (mut rows, mut further) = (Vec::new(), Vec::new());
    for config in &configs {
        let given = seeds.iter().find(|seeds| seeds.name == config.name);
        let given = given.map_or(vec![config.seed], |given| given.seeds.clone());
        for (index, seed) in given.into_iter().enumerate() {
            let folder = match seed == config.seed {
                true => config.name.clone(),
                false => format!("{}-seed-{seed}", config.name),
            };
            let config = ExperimentConfig {
                seed,
                ..config.clone()
            };
            let rows = if index == 0 { &mut rows } else { &mut further };
            rows.push(Row { config, folder });
        }
    }
    rows.extend(further);
    for Row { config, .. } in &rows {
        let name = config.name.clone();
        let valid = config.validate();
        valid.map_err(|source| ReproduceError::Seeds { name, source })?;
    }
    Ok((rows, printed))
}

/// The rows whose models `--only` names; all without it.
///
/// # Errors
/// A name that no row has.
pub fn chosen<'r>(
    rows: &'r [Row],
    only: &[String],
    folder: &Path,
) -> Result<Vec<&'r Row>, ReproduceError> {
    let configs: Vec<_> = rows.iter().map(|row| row.config.clone()).collect();
    for name in only {
        known(&configs, name, "--only", folder)?;
    }
    let is_chosen = |row: &&Row| only.is_empty() || only.contains(&row.config.name);
    Ok(rows.iter().filter(is_chosen).collect())
}

/// The folder for the runs where none is named: `runs/` and the name of the results' folder.
///
/// # Errors
/// That has no name.
pub fn runs_folder(out: &Path) -> Result<PathBuf, ReproduceError> {
    let name = out.file_name().ok_or_else(|| {
        let out = out.display();
        ReproduceError::Refused(format!(
            "--out {out} has no name for a folder of runs; give --runs"
        ))
    })?;
    Ok(Path::new("runs").join(name))
}

/// The data set of all rows.
///
/// # Errors
/// Two rows read or split the data otherwise, or the data cannot be used.
pub fn dataset(rows: &[Row], folder: &Path) -> Result<Dataset, ReproduceError> {
    let no_rows = || ReproduceError::Refused("there are no rows".into());
    let first = rows.first().ok_or_else(no_rows)?;
    let other = |row: &&Row| row.config.data != first.config.data;
    if let Some(row) = rows.iter().find(other) {
        let differences = row.config.differences(&ExperimentConfig {
            data: first.config.data.clone(),
            ..row.config.clone()
        })?;
        return Err(ReproduceError::Refused(format!(
            "rows of one table are on the same data, but {} and {} differ in {}",
            row.folder,
            first.folder,
            differences.join("; ")
        )));
    }
    Ok(Dataset::load(folder, &first.config.data)?)
}

fn known(
    configs: &[ExperimentConfig],
    name: &str,
    flag: &str,
    folder: &Path,
) -> Result<(), ReproduceError> {
    if configs.iter().any(|config| config.name == name) {
        return Ok(());
    }
    let mut names: Vec<&str> = configs.iter().map(|config| &*config.name).collect();
    names.dedup();
    Err(ReproduceError::Refused(format!(
        "{flag} {name}: {} has no such config, but {}",
        folder.display(),
        names.join(", ")
    )))
}

/// The TOML files of a folder, sorted.
fn files(folder: &Path) -> Result<Vec<PathBuf>, ReproduceError> {
    let paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| Ok(entry?.path())).collect())
        .map_err(|cause| {
            ReproduceError::Refused(format!(
                "the folder of configs {} cannot be read: {cause}",
                folder.display()
            ))
        })?;
    let is_config = |path: &PathBuf| {
        path.extension().is_some_and(|end| end == "toml")
            && path.file_name().is_some_and(|name| name != PRINTED)
    };
    let mut files: Vec<PathBuf> = paths.into_iter().filter(is_config).collect();
    if files.is_empty() {
        let folder = folder.into();
        return Err(ReproduceError::NoConfig { folder });
    }
    files.sort_unstable();
    Ok(files)
}

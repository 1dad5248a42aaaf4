//! The rows of a table: the configs of a folder, under one budget, with their seeds.

use std::path::{Path, PathBuf};

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

/// The file of a folder of configs that holds what the paper prints.
const PRINTED: &str = "paper.toml";

/// All rows of a folder of configs, and what the paper prints: first every model once, in the paper's order and then by name,
/// then further seeds.
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
        let load =
            |sets: &[String]| ExperimentConfig::load_under(&file, budget, sets).map_err(Box::new);
        let no_row = |source| ReproduceError::NoRow {
            file: file.clone(),
            source,
        };
        let name = load(&[]).map_err(no_row)?.name;
        let config = if only.is_empty() || only.contains(&name) {
            load(sets).map_err(no_row)?
        } else {
            let knows = |set: &&String| load(std::slice::from_ref(*set)).is_ok();
            let known: Vec<String> = sets.iter().filter(knows).cloned().collect();
            load(&known).map_err(no_row)?
        };
        if configs.iter().any(|other| other.name == config.name) {
            return Err(ReproduceError::SameName {
                folder: folder.into(),
                name: config.name,
            });
        }
        configs.push(config);
    }
    let printed = match std::fs::read_to_string(folder.join(PRINTED)) {
        Ok(text) => PrintedTables::parse(&text, &folder.join(PRINTED).display().to_string())?,
        Err(_) => configs[0].printed()?,
    };
    let place = |name: &str| printed.rows.iter().position(|row| row.name == name);
    configs.sort_by_key(|config| {
        (
            place(&config.name).unwrap_or(usize::MAX),
            config.name.clone(),
        )
    });
    for (index, Seeds { name, .. }) in seeds.iter().enumerate() {
        known(&configs, name, "--seeds", folder)?;
        if seeds[..index].iter().any(|other| other.name == *name) {
            return Err(ReproduceError::SeedsTwice { name: name.clone() });
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
    for row in &rows {
        row.config
            .validate()
            .map_err(|source| ReproduceError::Seeds {
                name: row.config.name.clone(),
                source,
            })?;
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

/// The data set of all rows.
///
/// # Errors
/// Two rows read or split the data otherwise, or the data cannot be used.
pub fn dataset(rows: &[Row], folder: &Path) -> Result<Dataset, ReproduceError> {
    let (first, others) = rows.split_first().ok_or(ReproduceError::NoRows)?;
    for row in others {
        if row.config.data != first.config.data {
            let differences = row.config.differences(&ExperimentConfig {
                data: first.config.data.clone(),
                ..row.config.clone()
            })?;
            return Err(ReproduceError::OtherDataConfig {
                row: row.folder.clone(),
                first: first.folder.clone(),
                differences,
            });
        }
    }
    Ok(Dataset::load(folder, &first.config.data)?)
}

fn known(
    configs: &[ExperimentConfig],
    name: &str,
    flag: &'static str,
    folder: &Path,
) -> Result<(), ReproduceError> {
    if configs.iter().any(|config| config.name == name) {
        return Ok(());
    }
    let mut names: Vec<String> = configs.iter().map(|config| config.name.clone()).collect();
    names.dedup();
    Err(ReproduceError::Unknown {
        flag,
        name: name.into(),
        folder: folder.into(),
        names,
    })
}

/// The TOML files of a folder, sorted.
fn files(folder: &Path) -> Result<Vec<PathBuf>, ReproduceError> {
    let unreadable = |cause| ReproduceError::Folder {
        folder: folder.into(),
        cause,
    };
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let is_config = path.extension().is_some_and(|end| end == "toml");
        if is_config && path.file_name().is_some_and(|name| name != PRINTED) {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(ReproduceError::NoConfig {
            folder: folder.into(),
        });
    }
    files.sort_unstable();
    Ok(files)
}

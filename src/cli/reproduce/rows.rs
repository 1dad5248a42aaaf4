//! The rows of a table: the configs of a folder, under one budget, with their seeds.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};

use crate::evaluation::paper;
use crate::experiment::ExperimentConfig;

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
        let threshold = self.config.data.contact_threshold;
        self.config.model.untrained(threshold).is_none()
    }
}

/// Seeds that a model is trained from, instead of its config's one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    pub name: String,
    pub seeds: Vec<u64>,
}

impl std::str::FromStr for Seeds {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || "expected NAME=SEED,SEED,..., such as whole_model=1,2,3".to_string();
        let (name, list) = text.split_once('=').ok_or_else(expected)?;
        let seeds = list.split(',').map(|seed| seed.trim().parse().ok());
        let seeds: Vec<u64> = seeds.collect::<Option<_>>().ok_or_else(expected)?;
        if seeds.iter().collect::<HashSet<_>>().len() != seeds.len() {
            return Err(format!("names a seed twice; {}", expected()));
        }
        Ok(Self {
            name: name.trim().into(),
            seeds,
        })
    }
}

/// All rows of a folder of configs: first every model once, in the order of the paper's tables and then by name, then further seeds.
///
/// # Errors
/// The folder holds no config, one is bad, two have the same name, or seeds are given for a model that is not there.
pub fn read(
    folder: &Path,
    budget: Option<&Path>,
    sets: &[String],
    seeds: &[Seeds],
) -> anyhow::Result<Vec<Row>> {
    let mut configs: Vec<ExperimentConfig> = Vec::new();
    for file in files(folder)? {
        let config = ExperimentConfig::load_under(&file, budget, sets)
            .with_context(|| format!("{} is no row", file.display()))?;
        if configs.iter().any(|other| other.name == config.name) {
            bail!(
                "two configs in {} are called {}; give each a name of its own",
                folder.display(),
                config.name
            );
        }
        configs.push(config);
    }
    let place = |name: &str| paper::ROWS.iter().position(|row| row.name == name);
    configs.sort_by_key(|config| {
        (
            place(&config.name).unwrap_or(usize::MAX),
            config.name.clone(),
        )
    });
    for (index, Seeds { name, .. }) in seeds.iter().enumerate() {
        known(&configs, name, "--seeds", folder)?;
        if seeds[..index].iter().any(|other| other.name == *name) {
            bail!("--seeds names {name} twice; give all its seeds in one list");
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
            .with_context(|| format!("--seeds {}", row.config.name))?;
    }
    Ok(rows)
}

/// The rows whose models `--only` names; all without it.
///
/// # Errors
/// A name that no row has.
pub fn chosen<'r>(rows: &'r [Row], only: &[String], folder: &Path) -> anyhow::Result<Vec<&'r Row>> {
    let configs: Vec<_> = rows.iter().map(|row| row.config.clone()).collect();
    for name in only {
        known(&configs, name, "--only", folder)?;
    }
    let is_chosen = |row: &&Row| only.is_empty() || only.contains(&row.config.name);
    Ok(rows.iter().filter(is_chosen).collect())
}

fn known(
    configs: &[ExperimentConfig],
    name: &str,
    flag: &str,
    folder: &Path,
) -> anyhow::Result<()> {
    if configs.iter().any(|config| config.name == name) {
        return Ok(());
    }
    let mut names: Vec<&str> = configs.iter().map(|config| config.name.as_str()).collect();
    names.dedup();
    bail!(
        "{flag} {name}: {} has no such config, but {}",
        folder.display(),
        names.join(", ")
    )
}

/// The TOML files of a folder, sorted.
fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let unreadable = || format!("the folder of configs {} cannot be read", folder.display());
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unreadable)? {
        let path = entry.with_context(unreadable)?.path();
        if path.extension().is_some_and(|end| end == "toml") {
            files.push(path);
        }
    }
    if files.is_empty() {
        bail!(
            "{} holds no config (.toml); experiments/pan2021 does",
            folder.display()
        );
    }
    files.sort_unstable();
    Ok(files)
}

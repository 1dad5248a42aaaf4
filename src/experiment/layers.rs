//! Configs from files: small overrides on a base, overrides of the command line on top, unknown
//! keys refused.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error as _;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;
use toml::{Table, Value};

use super::config::{ExperimentConfig, Shared};
use crate::models::ModelKind;
use crate::models::registry;
use crate::motion::{Mapping, MappingError};

/// The key that names the file that a config overrides.
const BASE: &str = "base";
/// Largest config file that is read, bytes.
const LARGEST_FILE: u64 = 1 << 20;
/// Most parts of a dotted key on the command line.
const DEEPEST_KEY: usize = 16;
/// Tables that are one thing: a layer's replaces that of the layer below.
const WHOLE: [&str; 3] = ["data.split", "data.mapping", "model.mapping"];
/// Tables that may name a mapping file by their key `mapping`.
const WITH_MAPPING: [&str; 2] = ["data", "model"];
/// Keys that every config may have and the defaults have not.
const OPTIONAL: [&str; 3] = ["paper", "start", "validation"];
/// The table of a budget with what is over single rows: `[rows.NAME]`.
const ROWS: &str = "rows";

/// Why there is no config.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// Which file or override is to blame, what is wrong with it, and what would do.
    #[error("{0}")]
    Refused(String),
    #[error("the config cannot be written as TOML")]
    Serialise(#[from] toml::ser::Error),
}

/// One cause of overrides, and what to call it in an error.
struct Layer {
    origin: String,
    table: Table,
    /// The files that say so.
    files: Vec<PathBuf>,
    /// Whether it is over models of every kind, as a budget is: its tables that belong to other
    /// kinds are left out.
    any_model: bool,
}

impl Layer {
    /// A layer with a mapping file's content in the place of its path, which counts from `folder`:
    /// so a config means the same wherever it is used, and whatever becomes of the file.
    fn new(origin: String, mut table: Table, folder: &Path) -> Result<Self, ConfigError> {
        let mut files = Vec::new();
        for name in WITH_MAPPING {
            let of = table.get_mut(name).and_then(Value::as_table_mut);
            let Some(value) = of.and_then(|table| table.get_mut("mapping")) else {
                continue;
            };
            let Some(path) = value.as_str() else { continue };
            let path = folder.join(path);
            let mapping = Mapping::read(&path).map_err(|error| {
                let what_to_do = match &error {
                    MappingError::Read { .. } if folder == Path::new("") => {
                        "; the path counts from the current folder"
                    }
                    MappingError::Read { .. } => {
                        "; the path counts from the config's folder, in the run of an earlier \
                         version, too: put the mapping file that it was made with there"
                    }
                    _ => "",
                };
                let cause = error.source().map(|cause| format!(": {cause}"));
                let cause = cause.unwrap_or_default();
                ConfigError::Refused(format!(
                    "{origin}: {name}.mapping: {error}{cause}{what_to_do}"
                ))
            })?;
            *value = Value::try_from(mapping)?;
            files.push(path);
        }
        Ok(Self {
            origin,
            table,
            files,
            any_model: false,
        })
    }
}

impl ExperimentConfig {
    /// Reads a TOML file. A top-level key `base` names another file that it overrides; keys that no
    /// file names have the paper's values. Paths in a file are relative to it. `sets` are overrides
    /// `a.b.c=value` on top: a value is TOML, a bare word is a string, a path is relative to the
    /// current folder.
    ///
    /// # Errors
    /// A file cannot be read or is not TOML; a key is unknown or has a value of the wrong kind or
    /// range (the file or override that says so is named); a file is its own base.
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, ConfigError> {
        Self::load_under(path, None, sets)
    }

    /// The same with a budget between the file and `sets`: a file of overrides that any experiment
    /// can be under. Its tables `[rows.NAME]` are over the experiment of this name alone.
    ///
    /// # Errors
    /// As [`ExperimentConfig::load`].
    pub fn load_under(
        path: &Path,
        budget: Option<&Path>,
        sets: &[String],
    ) -> Result<Self, ConfigError> {
        let mut layers = Vec::new();
        read_layers(path, &mut Vec::new(), &mut layers)?;
        if let Some(budget) = budget {
            let own = layers.len();
            read_layers(budget, &mut Vec::new(), &mut layers)?;
            layers[own..]
                .iter_mut()
                .for_each(|layer| layer.any_model = true);
        }
        for set in sets {
            layers.push(set_layer(set)?);
        }
        resolve(&layers)
    }

    /// The experiments that a budget has tables `[rows.NAME]` for.
    ///
    /// # Errors
    /// It cannot be read, or `rows` is none of tables.
    pub fn rows_of_budget(budget: &Path) -> Result<Vec<String>, ConfigError> {
        let mut layers = Vec::new();
        read_layers(budget, &mut Vec::new(), &mut layers)?;
        let mut names = Vec::new();
        for Layer { origin, table, .. } in layers {
            let Some(rows) = table.get(ROWS) else {
                continue;
            };
            let rows = rows
                .as_table()
                .filter(|rows| rows.values().all(Value::is_table));
            let rows = rows.ok_or_else(|| {
                ConfigError::Refused(format!("{origin}: {ROWS}: expected tables [{ROWS}.NAME]"))
            })?;
            names.extend(rows.keys().cloned());
        }
        Ok(names)
    }

    /// The defaults under `sets`.
    ///
    /// # Errors
    /// As [`ExperimentConfig::load`].
    pub fn with_sets(sets: &[String]) -> Result<Self, ConfigError> {
        let layers = sets.iter().map(|set| set_layer(set));
        resolve(&layers.collect::<Result<Vec<_>, _>>()?)
    }

    /// Reads a config from TOML text, without a base; a path in it counts from the current folder.
    ///
    /// # Errors
    /// As [`ExperimentConfig::load`]; `origin` names the text in them.
    pub fn parse(text: &str, origin: &str) -> Result<Self, ConfigError> {
        Self::parse_in(Path::new(""), text, origin)
    }

    /// The same where a path in it counts from `folder`.
    pub(crate) fn parse_in(folder: &Path, text: &str, origin: &str) -> Result<Self, ConfigError> {
        let table = parse_table(text, origin)?;
        resolve(&[Layer::new(origin.into(), table, folder)?])
    }

    /// The config as TOML with every key, which reads back as the same config.
    ///
    /// # Errors
    /// A number that TOML does not have.
    pub fn to_toml(&self) -> Result<String, ConfigError> {
        Ok(toml::to_string(&self.to_table()?)?)
    }

    fn to_table(&self) -> Result<Table, ConfigError> {
        let mut table = Table::new();
        for (key, value) in Table::try_from(self)? {
            let is_data = key == "data";
            table.insert(key, value);
            if is_data {
                table.extend(self.model.tables()?);
            }
        }
        Ok(table)
    }

    /// The keys whose values differ: `key: value here, value there`.
    ///
    /// # Errors
    /// A number that TOML does not have.
    pub fn differences(&self, other: &Self) -> Result<Vec<String>, ConfigError> {
        let (mut ours, mut theirs) = (BTreeMap::new(), BTreeMap::new());
        flatten("", &Value::Table(self.to_table()?), &mut ours);
        flatten("", &Value::Table(other.to_table()?), &mut theirs);
        let keys: BTreeSet<&String> = ours.keys().chain(theirs.keys()).collect();
        let value =
            |side: &BTreeMap<_, String>, key| side.get(key).map_or("none".into(), String::clone);
        let values = keys
            .into_iter()
            .map(|key| (key, value(&ours, key), value(&theirs, key)));
        let differing = values.filter(|(_, ours, theirs)| ours != theirs);
        Ok(differing
            .map(|(key, ours, theirs)| format!("{key}: {ours}, {theirs}"))
            .collect())
    }

    /// The differences that a training would notice: all but those of keys that act after the
    /// network.
    ///
    /// # Errors
    /// A number that TOML does not have.
    pub fn training_differences(&self, other: &Self) -> Result<Vec<String>, ConfigError> {
        let mut differences = self.differences(other)?;
        let after = other.model.keys_after_the_network();
        differences.retain(|difference| {
            let key = difference.split(':').next();
            key.is_none_or(|key| !after.contains(&key))
        });
        Ok(differences)
    }
}

/// The values of all dotted keys, as TOML.
fn flatten(key: &str, value: &Value, found: &mut BTreeMap<String, String>) {
    let Value::Table(table) = value else {
        found.insert(key.into(), value.to_string());
        return;
    };
    for (name, value) in table {
        flatten(&join(key, name), value, found);
    }
}

fn join(key: &str, name: &str) -> String {
    match key {
        "" => name.into(),
        _ => format!("{key}.{name}"),
    }
}

fn parse_table(text: &str, origin: &str) -> Result<Table, ConfigError> {
    text.parse().map_err(|cause: toml::de::Error| {
        ConfigError::Refused(format!("the config {origin} is not TOML: {cause}"))
    })
}

/// Adds the layers of a file to `layers`, its base's first. `above` are the files that rest on it.
fn read_layers(
    path: &Path,
    above: &mut Vec<PathBuf>,
    layers: &mut Vec<Layer>,
) -> Result<(), ConfigError> {
    let origin = path.display().to_string();
    let bad = |problem: &str| ConfigError::Refused(format!("the config {origin} {problem}"));
    let unreadable = |cause: io::Error| bad(&format!("cannot be read: {cause}"));
    let canonical = path.canonicalize().map_err(unreadable)?;
    let cycle = above.contains(&canonical);
    above.push(canonical);
    if cycle {
        let chain = above.iter().map(|path| path.display().to_string());
        let chain = chain.collect::<Vec<_>>().join(" -> ");
        let message = format!("{origin} is its own base: {chain}");
        return Err(ConfigError::Refused(message));
    }
    if std::fs::metadata(path).map_err(unreadable)?.len() > LARGEST_FILE {
        return Err(bad(&format!("has more than {LARGEST_FILE} bytes")));
    }
    let text = std::fs::read_to_string(path).map_err(unreadable)?;
    let mut table = parse_table(&text, &origin)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    match table.remove(BASE) {
        None => {}
        Some(Value::String(base)) => read_layers(&folder.join(base), above, layers)?,
        Some(other) => {
            return Err(ConfigError::Refused(format!(
                "{origin}: base = {other}: expected the name of a file in quotes"
            )));
        }
    }
    let mut layer = Layer::new(origin, table, folder)?;
    layer.files.push(path.into());
    layers.push(layer);
    Ok(())
}

fn set_layer(set: &str) -> Result<Layer, ConfigError> {
    let bad = |problem| {
        ConfigError::Refused(format!(
            "--set {set}: {problem}; expected KEY=VALUE such as schedule.fraction=0.005"
        ))
    };
    let (key, text) = set.split_once('=').ok_or_else(|| bad("has no '='"))?;
    let parts: Vec<&str> = key.trim().split('.').collect();
    if parts.len() > DEEPEST_KEY || parts.iter().any(|part| part.trim().is_empty()) {
        return Err(bad("is not a dotted key"));
    }
    let text = text.trim();
    let parsed = format!("value = {text}").parse::<Table>().ok();
    let parsed = parsed.filter(|table| table.len() == 1);
    let value = match parsed.and_then(|mut table| table.remove("value")) {
        Some(value) => value,
        None if text.starts_with(['[', '{', '"', '\'']) || text.contains(['\n', '\r']) => {
            return Err(bad("has a value that is not TOML"));
        }
        None => Value::String(text.into()),
    };
    let (outermost, inner) = (parts[0], &parts[1..]);
    let within = |value, part: &&str| Table::from_iter([(part.trim().to_string(), value)]);
    let inner = inner.iter().rev();
    let value = inner.fold(value, |value, part| Value::Table(within(value, part)));
    let table = within(value, &outermost);
    Layer::new(format!("--set {set}"), table, Path::new(""))
}

/// Merges the layers onto the defaults and checks after each, so that an error names the layer that
/// brought it.
fn resolve(layers: &[Layer]) -> Result<ExperimentConfig, ConfigError> {
    let no_kinds = || ConfigError::Refused("the registry: knows no kind of model".into());
    let mut kind = registry::kinds().into_iter().next().ok_or_else(no_kinds)?;
    let mut table = Table::try_from(Shared::default())?;
    table.remove("name");
    table.extend(kind.defaults());
    let mut read = None;
    let mut own = Vec::new();
    for Layer {
        origin,
        table: above,
        any_model,
        ..
    } in layers
    {
        if let Some(named) = above.get("model").and_then(|model| model.get("kind"))
            && named.as_str() != Some(kind.name())
        {
            let other = find_kind(named, origin)?;
            table.retain(|key, _| !kind.defaults().contains_key(key));
            table.extend(other.defaults());
            kind = other;
        }
        let mut above = above.clone();
        if *any_model {
            let known = kind.defaults();
            let others = registry::kinds();
            let of_others = |key: &str| others.iter().any(|it| it.defaults().contains_key(key));
            let rows = above.remove(ROWS);
            above.retain(|key, _| known.contains_key(key) || !of_others(key));
            for (name, value) in &mut above {
                let has = |defaults: &Table, key: &str| {
                    let table = defaults.get(name).and_then(Value::as_table);
                    table.is_some_and(|table| table.contains_key(key))
                };
                if let Some(table) = value.as_table_mut() {
                    let of_others =
                        |key: &str| others.iter().any(|other| has(&other.defaults(), key));
                    table.retain(|key, _| has(&known, key) || !of_others(key));
                }
            }
            let name = table.get("name").and_then(Value::as_str);
            let name = name.unwrap_or(kind.default_name());
            let row = rows.as_ref().and_then(|rows| rows.get(name));
            if let Some(row) = row.and_then(Value::as_table) {
                merge(&mut above, row, "");
            }
        }
        kind.rename_former_keys(&mut above);
        merge(&mut table, &above, "");
        read = Some(parse_layer(&table, &*kind, origin)?);
        own.push((origin.as_str(), above));
    }
    let mut config = match read {
        Some(config) => config,
        None => parse_layer(&table, &*kind, "the defaults")?,
    };
    config.validate().map_err(|cause| {
        let brings = |(_, table): &&(&str, Table)| has(table, &cause.key);
        let layer = own.iter().rev().find(brings).or(own.last());
        let origin = layer.map_or("the defaults", |(origin, _)| origin);
        ConfigError::Refused(format!("{origin}: {cause}"))
    })?;
    let files = layers.iter().flat_map(|layer| layer.files.clone());
    config.files = files.collect();
    // A budget is over any model; what it says of a part that this one lacks makes no other
    // experiment of it.
    let groups = config.model.rate_groups();
    let rates = &mut config.optimiser.rates;
    rates.retain(|group, _| groups.contains(&group.as_str()));
    let protocols = config.protocols();
    if let Some(validation) = &mut config.validation
        && let Some(protocol) = protocols.first()
        && validation.lengths.is_none()
    {
        let lengths = protocol.lengths();
        validation.lengths = (!lengths.is_empty()).then(|| lengths.to_vec());
    }
    Ok(config)
}

fn find_kind(named: &Value, origin: &str) -> Result<Arc<dyn ModelKind>, ConfigError> {
    let found = named.as_str().and_then(registry::find);
    found.ok_or_else(|| {
        let kinds = registry::kinds();
        let names: Vec<&str> = kinds.iter().map(|kind| kind.name()).collect();
        ConfigError::Refused(format!(
            "{origin}: model.kind = {named}: there is no such kind of model; known are {}",
            names.join(", ")
        ))
    })
}

/// The config that a merged table describes; `origin` is the layer that was merged last.
fn parse_layer(
    table: &Table,
    kind: &dyn ModelKind,
    origin: &str,
) -> Result<ExperimentConfig, ConfigError> {
    let unread = |error: toml::de::Error| {
        let message = error.to_string().trim_end().replace('\n', " ");
        ConfigError::Refused(format!("{origin}: {message}"))
    };
    let own = kind.defaults();
    let keys = table.clone().into_iter();
    let (given, mut shared): (Table, Table) = keys.partition(|(key, _)| own.contains_key(key));
    shared.entry("name").or_insert(kind.default_name().into());
    let known = Table::try_from(Shared::default())?;
    let other = |key: &&String| !known.contains_key(*key) && !OPTIONAL.contains(&key.as_str());
    if let Some(key) = shared.keys().find(other) {
        let mut expected: Vec<&str> = known.keys().chain(own.keys()).map(String::as_str).collect();
        expected.extend(OPTIONAL);
        expected.sort_unstable();
        return Err(ConfigError::Refused(format!(
            "{origin}: unknown key {key}: expected one of {}",
            expected.join(", ")
        )));
    }
    let shared: Shared = shared.try_into().map_err(unread)?;
    let config = ExperimentConfig {
        name: shared.name,
        paper: shared.paper,
        seed: shared.seed,
        start: shared.start,
        data: shared.data,
        model: kind.read(given.clone()).map_err(unread)?,
        optimiser: shared.optimiser,
        checkpoint: shared.checkpoint,
        log: shared.log,
        validation: shared.validation,
        files: Vec::new(),
    };
    // A model without fields takes any key without a word: what does not come back out was not
    // understood.
    match missing(&given, &config.model.tables()?, "") {
        Some(key) => Err(ConfigError::Refused(format!(
            "{origin}: unknown key {key}: remove it"
        ))),
        None => Ok(config),
    }
}

/// Whether a layer gives the dotted key.
fn has(table: &Table, key: &str) -> bool {
    let mut parts = key.split('.');
    let first = parts.next().and_then(|part| table.get(part));
    parts.fold(first, |value, part| value?.get(part)).is_some()
}

impl PartialEq for ExperimentConfig {
    fn eq(&self, other: &Self) -> bool {
        matches!((self.to_table(), other.to_table()), (Ok(ours), Ok(theirs)) if ours == theirs)
    }
}

impl Default for ExperimentConfig {
    /// What an empty file describes: the first model of the registry with the defaults of every
    /// key.
    ///
    /// # Panics
    /// Where the registry is empty.
    fn default() -> Self {
        resolve(&[]).expect("the defaults are a config")
    }
}

fn merge(below: &mut Table, above: &Table, key: &str) {
    // Fields of one kind of model mean nothing to another.
    let kind = above.get("kind");
    if kind.is_some() && kind != below.get("kind") {
        below.clear();
    }
    for (name, value) in above {
        let key = join(key, name);
        match (below.get_mut(name), value) {
            (Some(Value::Table(below)), Value::Table(above)) if !WHOLE.contains(&key.as_str()) => {
                merge(below, above, &key);
            }
            _ => {
                below.insert(name.clone(), value.clone());
            }
        }
    }
}

/// The first key of `given` that `understood` lacks.
fn missing(given: &Table, understood: &Table, key: &str) -> Option<String> {
    given.iter().find_map(|(name, value)| {
        let key = join(key, name);
        match (value, understood.get(name)) {
            (_, None) => Some(key),
            (Value::Table(given), Some(Value::Table(understood))) => {
                missing(given, understood, &key)
            }
            _ => None,
        }
    })
}

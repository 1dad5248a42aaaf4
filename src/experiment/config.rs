//! An experiment's config: what is trained, on what, how. What concerns one model alone is the
//! model's own.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::data::DataConfig;
use crate::evaluation::{EvaluationOptions, PrintedError, PrintedTables, Protocol};
use crate::models::Paper;
use crate::models::registry;
use crate::models::settings::{ModelSettings, ValueError};
use crate::optim::AdamConfig;

/// Longest window that a config may name, frames.
const LONGEST: usize = 10_000;
/// Most windows that a scoring may look at.
const MOST_WINDOWS: usize = 65_536;

/// A whole experiment. Every key may be left out.
#[derive(Debug, Clone, Serialize)]
pub struct ExperimentConfig {
    /// Name of the experiment in tables and manifests.
    pub name: String,
    /// The paper whose protocols, tables and figures it stands in; left out: the model's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<String>,
    /// What every random number of the training follows from; at most 2^63 - 1, as TOML has it.
    pub seed: u64,
    /// Name of the experiment whose trained weights it starts from, with fresh moments; left out:
    /// drawn ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    pub data: DataConfig,
    /// `[model]`, and the other tables that are the model's own.
    #[serde(skip)]
    pub model: Box<dyn ModelSettings>,
    pub optimiser: AdamConfig,
    pub checkpoint: CheckpointConfig,
    pub log: LogConfig,
    /// Left out: a training does not score itself on validation clips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<ValidationConfig>,
    /// The files that it was read from, those of its bases, budget and mapping among them.
    #[serde(skip)]
    pub files: Vec<PathBuf>,
}

/// What every experiment has, whatever its model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Shared {
    pub name: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<String>,
    pub seed: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start: Option<String>,
    pub data: DataConfig,
    pub optimiser: AdamConfig,
    pub checkpoint: CheckpointConfig,
    pub log: LogConfig,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<ValidationConfig>,
}

impl Default for Shared {
    fn default() -> Self {
        Self {
            name: "experiment".into(),
            paper: None,
            seed: 1,
            start: None,
            data: DataConfig::default(),
            optimiser: AdamConfig::default(),
            checkpoint: CheckpointConfig::default(),
            log: LogConfig::default(),
            validation: None,
        }
    }
}

/// When the state of a training is saved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CheckpointConfig {
    /// Steps from one checkpoint to the next.
    pub every_steps: u64,
    /// Checkpoints that are kept; at least 2 leave one to go back to when the newest is damaged.
    pub keep: usize,
}

impl Default for CheckpointConfig {
    fn default() -> Self {
        Self {
            every_steps: 200,
            keep: 2,
        }
    }
}

/// What is logged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LogConfig {
    /// Steps from one line of `log.jsonl` to the next; the last step is always logged.
    pub every_steps: u64,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self { every_steps: 1 }
    }
}

/// When a training scores itself on the clips that `data.validation_share` sets aside, and on how
/// many windows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValidationConfig {
    /// Steps from one scoring to the next; the last step is always scored.
    pub every_steps: u64,
    /// Windows of each length, the same each time, spread evenly over the validation clips.
    pub windows: usize,
    /// Lengths, frames; left out: those of the model's protocol.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lengths: Option<Vec<usize>>,
    /// Whether the training ends with the weights of its best score, by the first metric of its
    /// protocol, in the place of its last.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub keep_best: bool,
}

impl Default for ValidationConfig {
    fn default() -> Self {
        Self {
            every_steps: 500,
            windows: 32,
            lengths: None,
            keep_best: false,
        }
    }
}

impl ExperimentConfig {
    /// The paper whose protocols, tables and figures it stands in; none of a model that is not in
    /// the registry.
    pub fn paper(&self) -> Option<Paper> {
        match &self.paper {
            Some(name) => registry::papers().into_iter().find(|it| it.name == *name),
            None => {
                let kind = registry::find(self.model.kind())?;
                kind.papers().into_iter().next()
            }
        }
    }

    /// How the paper's tables score it.
    pub fn protocols(&self) -> Vec<Box<dyn Protocol>> {
        self.protocols_with(&EvaluationOptions::default())
    }

    /// The same with what is chosen of them.
    pub fn protocols_with(&self, options: &EvaluationOptions) -> Vec<Box<dyn Protocol>> {
        let paper = self.paper();
        paper.map_or(Vec::new(), |paper| (paper.protocols)(&self.data, options))
    }

    /// Further ways to score it, which no table has.
    pub fn protocols_by_name(&self, options: &EvaluationOptions) -> Vec<Box<dyn Protocol>> {
        let paper = self.paper();
        paper.map_or(Vec::new(), |paper| (paper.by_name)(&self.data, options))
    }

    /// What its paper prints.
    ///
    /// # Errors
    /// A model from outside whose paper's numbers are no such file.
    pub fn printed(&self) -> Result<PrintedTables, PrintedError> {
        match self.paper() {
            Some(paper) => {
                PrintedTables::parse(paper.printed, &format!("{}/paper.toml", paper.name))
            }
            None => Ok(PrintedTables::default()),
        }
    }

    /// Checks every value by itself and against the others.
    ///
    /// # Errors
    /// The first value out of its range: its key, and what would do.
    pub fn validate(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        let at_least_1 =
            |key: &str, value: u64| ValueError::unless(value > 0, key, value, "at least 1");
        ValueError::unless(
            is_name(&self.name),
            "name",
            &self.name,
            "letters, digits, '_', '-' and '.' only, at least one, beginning with a letter or digit",
        )?;
        if let Some(name) = &self.start {
            ValueError::unless(is_name(name), "start", name, "the name of an experiment")?;
        }
        if let Some(name) = &self.paper {
            let papers = registry::papers();
            let known: Vec<&str> = papers.iter().map(|paper| paper.name).collect();
            let expected = format!("one of {}", known.join(", "));
            ValueError::unless(known.contains(&&**name), "paper", name, expected)?;
        }
        let most_seed = i64::MAX as u64;
        let expected = format!("at most {most_seed}");
        ValueError::unless(self.seed <= most_seed, "seed", self.seed, expected)?;
        self.model.check(&self.data)?;
        at_least_1("checkpoint.every_steps", self.checkpoint.every_steps)?;
        within("checkpoint.keep", self.checkpoint.keep, 1, 1000)?;
        at_least_1("log.every_steps", self.log.every_steps)?;
        if let Some(validation) = &self.validation {
            at_least_1("validation.every_steps", validation.every_steps)?;
            within("validation.windows", validation.windows, 1, MOST_WINDOWS)?;
            if let Some(lengths) = &validation.lengths {
                ValueError::unless(
                    !lengths.is_empty() && lengths.iter().all(|n| (1..=LONGEST).contains(n)),
                    "validation.lengths",
                    format!("{lengths:?}"),
                    format!("at least one length from 1 to {LONGEST}"),
                )?;
            }
        }
        self.optimiser.check().map_err(|setting| ValueError {
            key: format!("optimiser.{}", setting.key),
            value: setting.value.to_string(),
            expected: setting.expected.into(),
        })
    }
}

fn is_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    name.starts_with(|c: char| c.is_ascii_alphanumeric()) && name.chars().all(allowed)
}

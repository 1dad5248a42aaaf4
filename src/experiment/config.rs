//! An experiment's config: what is trained, on what, by which schedule. The defaults are the paper's.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::data::DataConfig;
use crate::models::ModelConfig;
use crate::optim::AdamConfig;
use crate::training::validation::ValidationConfig;

/// Longest transition that a schedule may name, frames.
const LONGEST: usize = 10_000;
/// Most windows that a batch may have.
const LARGEST_BATCH: usize = 65_536;

/// A whole experiment. Every key may be left out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ExperimentConfig {
    /// Name of the experiment in tables and manifests.
    pub name: String,
    /// What every random number of the training follows from; at most 2^63 - 1, as TOML has it.
    pub seed: u64,
    pub data: DataConfig,
    pub model: ModelConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
    pub optimiser: AdamConfig,
    pub scheduled_sampling: ScheduledSamplingConfig,
    pub checkpoint: CheckpointConfig,
    pub log: LogConfig,
    /// Left out: a training does not score itself on validation clips.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<ValidationConfig>,
}

impl Default for ExperimentConfig {
    fn default() -> Self {
        Self {
            name: "whole_model".into(),
            seed: 1,
            data: DataConfig::default(),
            model: ModelConfig::default(),
            schedule: ScheduleConfig::default(),
            augmentation: AugmentationConfig::default(),
            optimiser: AdamConfig::default(),
            scheduled_sampling: ScheduledSamplingConfig::default(),
            checkpoint: CheckpointConfig::default(),
            log: LogConfig::default(),
            validation: None,
        }
    }
}

/// The curriculum: in epoch e (from 0) every transition length from
/// `min(min_len + min_len_step floor(e / min_len_every), max_len)` to `min(min_len + max_len_step e, max_len)` frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    /// Shortest and longest transition of the first epoch, frames.
    pub min_len: usize,
    /// Longest transition of the last epoch, frames.
    pub max_len: usize,
    /// How much the longest transition grows from one epoch to the next, frames.
    pub max_len_step: usize,
    /// How much the shortest transition grows every `min_len_every` epochs, frames.
    pub min_len_step: usize,
    /// Epochs until the shortest transition grows again.
    pub min_len_every: usize,
    /// Most windows in a batch.
    pub batch_size: usize,
    /// Parts that a batch is computed in. The weights depend on it, in the last bits; they do not on the number of threads.
    pub shards: usize,
    /// Share of the schedule that is trained, above 0 and at most 1: random windows of the lengths of every epoch, below 1 in whole
    /// batches, see [`super::Schedule::new`].
    pub fraction: f64,
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            min_len: 5,
            max_len: 70,
            max_len_step: 1,
            min_len_step: 4,
            min_len_every: 5,
            batch_size: 128,
            shards: 4,
            fraction: 1.0,
        }
    }
}

/// What is trained beside the recorded windows; the paper trains nothing else.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Each window that is trained is with probability 1/2 the one that a mirror shows, see [`crate::motion::mirror_image`]; the
    /// statistics of the data are over the clips and their images.
    pub mirror: bool,
    /// Each window that is trained is, with the same probability, of the recorded clip or of the same clip at one of these tempi (1.25: a
    /// quarter faster), see [`crate::motion::at_tempo`]; of the recorded one where it would be too long for that at this tempo. The statistics
    /// of the data leave them out. 16 at most, each from 0.25 to 4; at each, the training clips are in memory once more.
    pub tempi: Vec<f64>,
}

/// Scheduled sampling: one draw a batch, ground truth is fed with probability beta.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduledSamplingConfig {
    /// Factor of beta from one step of the whole schedule to the next, above 0 and at most 1; see
    /// [`super::Schedule::teacher_forcing`].
    pub decay: f64,
}

impl Default for ScheduledSamplingConfig {
    fn default() -> Self {
        Self { decay: 0.99995 }
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

/// A value that no experiment can have.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{key} = {value}: expected {expected}")]
pub struct ValueError {
    pub key: &'static str,
    pub value: String,
    pub expected: String,
}

impl ExperimentConfig {
    /// Checks every value by itself and against the others.
    ///
    /// # Errors
    /// The first value out of its range: its key, and what would do.
    pub fn validate(&self) -> Result<(), ValueError> {
        let schedule = &self.schedule;
        let within = |key, value: usize, least: usize, most: usize| {
            check(key, value, (least..=most).contains(&value), || {
                format!("a whole number from {least} to {most}")
            })
        };
        check("name", &self.name, is_name(&self.name), || {
            "letters, digits, '_', '-' and '.' only, at least one, beginning with a letter or digit"
                .into()
        })?;
        let most_seed = i64::MAX as u64;
        check("seed", self.seed, self.seed <= most_seed, || {
            format!("at most {most_seed}")
        })?;
        within("schedule.min_len", schedule.min_len, 1, LONGEST)?;
        within(
            "schedule.max_len",
            schedule.max_len,
            schedule.min_len,
            LONGEST,
        )?;
        within("schedule.max_len_step", schedule.max_len_step, 1, LONGEST)?;
        within("schedule.min_len_step", schedule.min_len_step, 0, LONGEST)?;
        within("schedule.min_len_every", schedule.min_len_every, 1, LONGEST)?;
        within("schedule.batch_size", schedule.batch_size, 1, LARGEST_BATCH)?;
        within("schedule.shards", schedule.shards, 1, schedule.batch_size)?;
        let share = "above 0 and at most 1";
        let is_share = |x: f64| x > 0.0 && x <= 1.0;
        let decay = self.scheduled_sampling.decay;
        let fraction = schedule.fraction;
        check("schedule.fraction", fraction, is_share(fraction), || {
            share.into()
        })?;
        check("scheduled_sampling.decay", decay, is_share(decay), || {
            share.into()
        })?;
        let tempi = &self.augmentation.tempi;
        let usable = tempi.len() <= 16 && tempi.iter().all(|tempo| (0.25..=4.0).contains(tempo));
        check("augmentation.tempi", format!("{tempi:?}"), usable, || {
            "at most 16 tempi from 0.25 to 4".into()
        })?;
        if let ModelConfig::Harvey2020(model) = &self.model {
            let (own, data) = (model.facing_sigma, self.data.facing_sigma);
            check("model.facing_sigma", own, own == data, || {
                format!(
                    "{data}, the value of data.facing_sigma: p^b is compared where both turn alike"
                )
            })?;
        }
        let every = self.checkpoint.every_steps;
        check("checkpoint.every_steps", every, every > 0, || {
            "at least 1".into()
        })?;
        within("checkpoint.keep", self.checkpoint.keep, 1, 1000)?;
        let every = self.log.every_steps;
        check("log.every_steps", every, every > 0, || "at least 1".into())?;
        if let Some(validation) = &self.validation {
            let every = validation.every_steps;
            check("validation.every_steps", every, every > 0, || {
                "at least 1".into()
            })?;
            within("validation.windows", validation.windows, 1, LARGEST_BATCH)?;
            let lengths = &validation.lengths;
            check(
                "validation.lengths",
                format!("{lengths:?}"),
                !lengths.is_empty() && lengths.iter().all(|n| (1..=LONGEST).contains(n)),
                || format!("at least one length from 1 to {LONGEST}"),
            )?;
        }
        let adam = &self.optimiser;
        let positive = |key, x: f64| {
            check(key, x, x > 0.0 && x.is_finite(), || {
                "a number above 0".into()
            })
        };
        let is_beta = |x: f64| (0.0..1.0).contains(&x);
        let beta = || "at least 0 and below 1".to_string();
        positive("optimiser.learning_rate", adam.learning_rate)?;
        if let Some(rate) = adam.transformer_learning_rate {
            positive("optimiser.transformer_learning_rate", rate)?;
        }
        check("optimiser.beta1", adam.beta1, is_beta(adam.beta1), beta)?;
        check("optimiser.beta2", adam.beta2, is_beta(adam.beta2), beta)?;
        positive("optimiser.epsilon", adam.epsilon)?;
        if let Some(norm) = adam.clip_norm {
            positive("optimiser.clip_norm", norm)?;
        }
        let Some(rate) = adam.rate_schedule else {
            return Ok(());
        };
        let left = rate.final_share;
        check(
            "optimiser.rate_schedule.final_share",
            left,
            (0.0..=1.0).contains(&left),
            || "at least 0 and at most 1".into(),
        )
    }
}

/// An error unless `valid`.
fn check(
    key: &'static str,
    value: impl std::fmt::Display,
    valid: bool,
    expected: impl FnOnce() -> String,
) -> Result<(), ValueError> {
    if valid {
        Ok(())
    } else {
        Err(ValueError {
            key,
            value: value.to_string(),
            expected: expected(),
        })
    }
}

fn is_name(name: &str) -> bool {
    name.starts_with(|c: char| c.is_ascii_alphanumeric())
        && name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c))
}

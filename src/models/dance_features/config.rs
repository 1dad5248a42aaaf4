//! The tables of a config that say what the columns are.

use serde::{Deserialize, Serialize};

use crate::models::Shards;
use crate::models::settings::ValueError;
use crate::music::FeatureSet;

/// Which numbers of the music a model takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Audio {
    /// 80 mel bands, onset strength, nearness of a beat and of a downbeat, two principal components
    /// of 8-band flux.
    #[default]
    Transflower85,
    /// Onset strength and nearness of a beat, which all data sets have.
    OnsetBeats,
    /// The numbers that the data set gives, raw magnitudes x as log(1 + x).
    AsGiven,
}

/// `[features]`
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeaturesConfig {
    pub audio: Audio,
    /// Whether each joint's rotation is measured from its mean over the training part; else from
    /// none.
    pub centre_rotations: bool,
}

/// `[augmentation]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Whether the mirror image of every training piece is trained, too.
    pub mirror: bool,
    /// Deviation of the Gaussian noise that training adds to targets and motion context, in
    /// deviations of their columns.
    pub target_noise: f64,
}

impl Default for AugmentationConfig {
    fn default() -> Self {
        Self {
            mirror: true,
            target_noise: 0.0,
        }
    }
}

impl Audio {
    /// What is heard of a sound for it; none where only a data set can give its numbers.
    pub fn feature_set(self) -> Option<FeatureSet> {
        match self {
            Self::Transflower85 => Some(FeatureSet::Transflower91),
            Self::OnsetBeats => Some(FeatureSet::OnsetBeats),
            Self::AsGiven => None,
        }
    }
}

impl AugmentationConfig {
    /// # Errors
    /// A value outside its range.
    pub fn check(&self) -> Result<(), ValueError> {
        ValueError::unless(
            self.target_noise.is_finite() && self.target_noise >= 0.0,
            "augmentation.target_noise",
            self.target_noise,
            "a number of deviations, 0 or more",
        )
    }
}

/// Least windows in a shard that are hardly slower than more.
const WORTHWHILE: usize = 32;

/// `[schedule]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    pub steps: u64,
    /// Windows of a step.
    pub batch_size: usize,
    /// Parts that a batch is computed in.
    pub shards: Shards,
    /// Only training clips whose names begin with one of these; left out: all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clips: Vec<String>,
}

/// `[generation]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GenerationConfig {
    /// tau, deviation of the noise that dances are made from.
    pub temperature: f64,
    /// Bound of what is fed back, deviations; left out: none, and beyond 10 an error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clamp: Option<f64>,
    /// Behind the end of the music its last frame is heard on.
    pub pad_audio: bool,
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            steps: 600_000,
            batch_size: 336,
            shards: Shards::default(),
            clips: Vec::new(),
        }
    }
}

impl Default for GenerationConfig {
    fn default() -> Self {
        Self {
            temperature: 1.0,
            clamp: None,
            pad_audio: true,
        }
    }
}

impl ScheduleConfig {
    /// # Errors
    /// A value outside its range.
    pub fn check(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, most: usize| {
            let expected = format!("a whole number from 1 to {most}");
            ValueError::unless((1..=most).contains(&value), key, value, expected)
        };
        ValueError::unless(self.steps > 0, "schedule.steps", 0, "at least 1")?;
        within("schedule.batch_size", self.batch_size, 65_536)?;
        self.shards.check(self.batch_size)
    }

    /// Shards of a step.
    pub fn shards(&self) -> usize {
        self.shards.count(self.batch_size, WORTHWHILE)
    }
}

impl GenerationConfig {
    /// Its keys, none of which the weights depend on.
    pub const KEYS: &'static [&'static str] = &[
        "generation.temperature",
        "generation.clamp",
        "generation.pad_audio",
    ];

    /// # Errors
    /// A value outside its range.
    pub fn check(&self) -> Result<(), ValueError> {
        let (temperature, clamp) = (self.temperature, self.clamp.unwrap_or(1.0));
        let usable = temperature.is_finite() && temperature >= 0.0;
        ValueError::unless(usable, "generation.temperature", temperature, "0 or more")?;
        let usable = clamp.is_finite() && clamp > 0.0;
        ValueError::unless(usable, "generation.clamp", clamp, "more than 0")
    }
}

//! Its tables of a config.

use serde::{Deserialize, Serialize};

use super::NAME;
use super::generator::LinearGaussian;
use crate::data::DataConfig;
use crate::models::Generator;
use crate::models::dance_features::{Contexts, FeaturesConfig, GenerationConfig};
use crate::models::settings::{ModelSettings, ValueError};

/// What the next frames are expected to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Base {
    /// 0, the mean of standardised numbers that are seen in a mirror, too.
    Zero,
    /// The mean over training, of all N together.
    Mean,
    /// The last known frame, for all N.
    LastFrame,
    /// Of all N together a ridge regression on the last three known frames.
    LastFrames,
    /// Of each a ridge regression on its own three predecessors.
    #[default]
    OwnFrames,
}

/// How the error is spread.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Covariance {
    /// A deviation of 1 in every number.
    Unit,
    /// A deviation of its own in every number.
    Diagonal,
    #[default]
    Full,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LinearGaussianConfig {
    /// "linear_gaussian".
    pub kind: String,
    pub base: Base,
    pub covariance: Covariance,
    /// N, whose likelihood is told.
    pub predicted_frames: usize,
    /// Frames that a window knows: so that windows are those of the models beside it, since three
    /// are looked at and no music is heard.
    pub motion_context: usize,
    pub audio_past: usize,
    pub audio_future: usize,
}

impl Default for LinearGaussianConfig {
    fn default() -> Self {
        Self {
            kind: NAME.into(),
            base: Base::default(),
            covariance: Covariance::default(),
            predicted_frames: 3,
            motion_context: 120,
            audio_past: 120,
            audio_future: 20,
        }
    }
}

/// `[augmentation]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MirrorConfig {
    /// Whether numbers are standardised, and the model is fitted, with mirror images, too.
    pub mirror: bool,
}

impl Default for MirrorConfig {
    fn default() -> Self {
        Self { mirror: true }
    }
}

/// What is its own in a config.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    pub model: LinearGaussianConfig,
    pub features: FeaturesConfig,
    pub augmentation: MirrorConfig,
    pub generation: GenerationConfig,
}

impl LinearGaussianConfig {
    pub fn contexts(&self) -> Contexts {
        Contexts {
            motion: self.motion_context,
            audio_past: self.audio_past,
            audio_future: self.audio_future,
            predicted: self.predicted_frames,
        }
    }
}

impl ModelSettings for Settings {
    fn kind(&self) -> &str {
        NAME
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        let model = &self.model;
        let within = |key: &'static str, value: usize, least: usize| {
            let expected = format!("{least} to 10000");
            ValueError::unless((least..=10_000).contains(&value), key, value, &expected)
        };
        within("model.predicted_frames", model.predicted_frames, 1)?;
        within(
            "model.motion_context",
            model.motion_context,
            super::fit::LOOK_BACK,
        )?;
        within("model.audio_past", model.audio_past, 0)?;
        within("model.audio_future", model.audio_future, 1)?;
        self.generation.check()
    }

    fn keys_after_the_network(&self) -> &'static [&'static str] {
        GenerationConfig::KEYS
    }

    fn untrained(&self, _data: &DataConfig) -> Option<Box<dyn Generator>> {
        Some(Box::new(LinearGaussian::new(self.clone())))
    }
}

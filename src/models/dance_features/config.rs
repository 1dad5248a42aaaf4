//! The tables of a config that say what the columns are.

use serde::{Deserialize, Serialize};

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

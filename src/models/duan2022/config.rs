//! The tables of a config that are this model's.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::Duan2022;
use crate::autograd::Real;
use crate::data::DataConfig;
use crate::models::AugmentationConfig;
use crate::models::ModelError;
use crate::models::rotations::{
    Body, RotationNetwork, RotationSettings, ScheduleConfig, WindowStatistics,
};
use crate::models::settings::ValueError;
use crate::models::transition::RootFrame;
use crate::motion::ContactRule;
use crate::nn::Initialiser;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Duan2022Settings {
    pub model: Duan2022Config,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Duan2022Config {
    /// "duan2022".
    pub kind: String,
    /// Numbers of a frame's token.
    pub width: usize,
    pub layers: usize,
    pub heads: usize,
    pub feed_forward: usize,
    pub dropout: f64,
    /// The last convolution begins at 0, so that training begins at the interpolation.
    pub zero_decoder: bool,
    /// "world", or "keyframe_facing": every window turned so that its first keyframe faces +Z.
    pub root_frame: RootFrame,
}

impl Default for Duan2022Config {
    fn default() -> Self {
        Self {
            kind: Duan2022Settings::KIND.into(),
            width: 256,
            layers: 6,
            heads: 8,
            feed_forward: 1024,
            dropout: 0.1,
            zero_decoder: false,
            root_frame: RootFrame::World,
        }
    }
}

impl RotationSettings for Duan2022Settings {
    const KIND: &'static str = "duan2022";

    fn schedule(&self) -> &ScheduleConfig {
        &self.schedule
    }

    fn augmentation(&self) -> &AugmentationConfig {
        &self.augmentation
    }

    fn root_frame(&self) -> RootFrame {
        self.model.root_frame
    }

    fn contact_rule(&self) -> ContactRule {
        ContactRule::LowerAnkle
    }

    fn check_own(&self, _data: &DataConfig) -> Result<(), ValueError> {
        let Duan2022Config {
            width,
            layers,
            heads,
            feed_forward,
            dropout,
            ..
        } = self.model;
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            let key = format!("model.{key}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        within("layers", layers, 1, 64)?;
        within("heads", heads, 1, 1024)?;
        within("width", width, 1, 65_536)?;
        within("feed_forward", feed_forward, 1, 65_536)?;
        let multiple = width.is_multiple_of(heads);
        let expected = format!("a multiple of model.heads = {heads}");
        ValueError::unless(multiple, "model.width", width, expected)?;
        let (share, expected) = ((0.0..1.0).contains(&dropout), "0 to below 1");
        ValueError::unless(share, "model.dropout", dropout, expected)
    }

    fn network<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Box<dyn RotationNetwork<T>>, ModelError> {
        let network = Duan2022::new(init, self, body, statistics);
        Ok(Box::new(network.map_err(|error| ModelError::data(&error))?))
    }

    fn small(&self) -> Self {
        let model = Duan2022Config {
            width: 8,
            layers: 2,
            heads: 2,
            feed_forward: 12,
            ..self.model.clone()
        };
        Self {
            model,
            ..self.clone()
        }
    }
}

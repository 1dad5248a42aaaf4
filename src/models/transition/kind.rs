//! The models of transitions by their name in a config: the one place that names them all.

use serde::{Deserialize, Serialize};
use toml::Table;

use super::settings::TransitionSettings;
use super::{Network, RootFrame, Standardisation};
use crate::autograd::Real;
use crate::data::DataConfig;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::baselines::linear_positions::LinearPositions;
use crate::models::baselines::zero_velocity::ZeroVelocity;
use crate::models::harvey2020::{Harvey2020, Harvey2020Config};
use crate::models::kind::{ModelKind, Paper};
use crate::models::pan2021::{CYCLIC, Controllers, PAPER, Pan2021, Pan2021Config, TRANSFORMERS};
use crate::models::settings::{ModelSettings, ValueError, without_weights};
use crate::models::{Generator, ModelError, li2023};
use crate::motion::Mapping;
use crate::nn::Initialiser;

/// A kind of transition model: a line of the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Pan2021,
    Harvey2020,
    Interpolation,
    LinearPositions,
    ZeroVelocity,
}

/// The `[model]` table of an experiment's config; `kind` says which.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ModelConfig {
    /// Pan et al. 2021, and its ablations.
    Pan2021(Pan2021Config),
    /// Harvey et al. 2020, with or without its critics.
    Harvey2020(Harvey2020Config),
    /// Slerp between the keyframes; nothing to train.
    Interpolation(NoSettings),
    /// Joint positions on straight lines between the keyframes; nothing to train.
    LinearPositions(NoSettings),
    /// The first keyframe's pose held; nothing to train.
    ZeroVelocity(NoSettings),
}

/// A table without keys.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NoSettings {}

impl ModelKind for Kind {
    fn name(&self) -> &str {
        self.config().kind()
    }

    fn default_name(&self) -> &str {
        match self {
            Self::Pan2021 => "whole_model",
            _ => self.name(),
        }
    }

    fn papers(&self) -> Vec<Paper> {
        match self {
            Self::Pan2021 => [&[PAPER, CYCLIC], &li2023::PAPERS[..]].concat(),
            _ => vec![PAPER, CYCLIC],
        }
    }

    fn defaults(&self) -> Table {
        let settings = TransitionSettings {
            model: self.config(),
            ..TransitionSettings::default()
        };
        // The defaults hold numbers that TOML has, which a test proves of every kind.
        Table::try_from(settings).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<TransitionSettings>()?))
    }

    /// `optimiser.transformer_learning_rate` is `optimiser.rates.transformers` now.
    fn rename_former_keys(&self, layer: &mut Table) {
        let Some(optimiser) = layer.get_mut("optimiser").and_then(|it| it.as_table_mut()) else {
            return;
        };
        if let Some(rate) = optimiser.remove("transformer_learning_rate") {
            let rates = optimiser
                .entry("rates")
                .or_insert_with(|| Table::new().into());
            if let Some(rates) = rates.as_table_mut() {
                rates.insert(TRANSFORMERS.into(), rate);
            }
        }
    }
}

impl Kind {
    fn config(self) -> ModelConfig {
        match self {
            Self::Pan2021 => ModelConfig::Pan2021(Pan2021Config::default()),
            Self::Harvey2020 => ModelConfig::Harvey2020(Harvey2020Config::default()),
            Self::Interpolation => ModelConfig::Interpolation(NoSettings {}),
            Self::LinearPositions => ModelConfig::LinearPositions(NoSettings {}),
            Self::ZeroVelocity => ModelConfig::ZeroVelocity(NoSettings {}),
        }
    }
}

impl Default for ModelConfig {
    fn default() -> Self {
        Kind::Pan2021.config()
    }
}

impl ModelConfig {
    /// What `model.kind` says.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Pan2021(_) => "pan2021",
            Self::Harvey2020(_) => "harvey2020",
            Self::Interpolation(_) => "interpolation",
            Self::LinearPositions(_) => "linear_positions",
            Self::ZeroVelocity(_) => "zero_velocity",
        }
    }

    /// The network to train, its weights added through `init`.
    ///
    /// # Errors
    /// A model that is not trained; settings that do not fit together; more weights than `init`
    /// allows.
    pub fn build<T: Real, R: rand::Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        standardisation: &Standardisation,
    ) -> Result<Box<dyn Network<T>>, ModelError> {
        let network: Box<dyn Network<T>> = match self {
            Self::Pan2021(config) => Box::new(Pan2021::new(init, config, standardisation)?),
            Self::Harvey2020(config) => Box::new(Harvey2020::new(init, config, standardisation)?),
            Self::Interpolation(_) | Self::LinearPositions(_) | Self::ZeroVelocity(_) => {
                return Err(without_weights(self.kind()));
            }
        };
        match init.exceeded() {
            None => Ok(network),
            Some(most) => Err(ModelError::TooLarge { most }),
        }
    }

    /// Checks the values of the table.
    ///
    /// # Errors
    /// The first out of its range.
    pub fn check(&self, data: &DataConfig) -> Result<(), ValueError> {
        match self {
            Self::Pan2021(config) => config.check(),
            Self::Harvey2020(config) => {
                config.check()?;
                let (own, data) = (config.facing_sigma, data.facing_sigma);
                let expected = format!(
                    "{data}, the value of data.facing_sigma: p^b is compared where both turn alike"
                );
                ValueError::unless(own == data, "model.facing_sigma", own, expected)
            }
            Self::Interpolation(_) | Self::LinearPositions(_) | Self::ZeroVelocity(_) => Ok(()),
        }
    }

    /// The frame of reference of the root's numbers in the windows that the network reads.
    pub fn root_frame(&self) -> RootFrame {
        match self {
            Self::Pan2021(config) => config.root_frame,
            _ => RootFrame::World,
        }
    }

    /// Whether what its network predicts is brought to the velocity factors that were asked for,
    /// see [`super::velocity_refinement`].
    pub fn refines_velocities(&self) -> bool {
        match self {
            Self::Pan2021(config) => config.velocity_refinement,
            _ => false,
        }
    }

    /// How it sees clips on another skeleton than the dance skeleton.
    pub fn mapping(&self) -> Option<&Mapping> {
        match self {
            Self::Pan2021(config) => config.mapping.as_ref(),
            _ => None,
        }
    }

    /// The groups of learning rates that its weights fall into.
    pub fn rate_groups(&self) -> &'static [&'static str] {
        match self {
            Self::Pan2021(config) if config.controllers == Controllers::Transformer => {
                &[TRANSFORMERS]
            }
            _ => &[],
        }
    }

    /// The same structure in small sizes, for checks in f64.
    pub fn small(&self) -> Self {
        match self {
            Self::Pan2021(config) => Self::Pan2021(config.small()),
            Self::Harvey2020(config) => Self::Harvey2020(config.small()),
            Self::Interpolation(_) | Self::LinearPositions(_) | Self::ZeroVelocity(_) => {
                self.clone()
            }
        }
    }

    /// The model, where it needs no training.
    pub fn untrained(&self, contact_threshold: f64) -> Option<Box<dyn Generator>> {
        match self {
            Self::Interpolation(_) => Some(Box::new(Interpolation { contact_threshold })),
            Self::LinearPositions(_) => Some(Box::new(LinearPositions { contact_threshold })),
            Self::ZeroVelocity(_) => Some(Box::new(ZeroVelocity { contact_threshold })),
            Self::Pan2021(_) | Self::Harvey2020(_) => None,
        }
    }
}

//! The models by their name in a config: the one place that names them all.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::ModelError;
use super::baselines::interpolation::Interpolation;
use super::baselines::linear_positions::LinearPositions;
use super::baselines::zero_velocity::ZeroVelocity;
use super::harvey2020::{Harvey2020, Harvey2020Config};
use super::pan2021::{Controllers, Pan2021, Pan2021Config};
use super::transition::{Network, TransitionModel};
use super::transition::{RootFrame, Standardisation};
use crate::autograd::Real;
use crate::nn::Initialiser;

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

impl Default for ModelConfig {
    fn default() -> Self {
        Self::Pan2021(Pan2021Config::default())
    }
}

impl ModelConfig {
    /// The network to train, its weights added through `init`.
    ///
    /// # Errors
    /// A model that is not trained; settings that do not fit together; more weights than `init` allows.
    pub fn build<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        standardisation: &Standardisation,
    ) -> Result<Box<dyn Network<T>>, ModelError> {
        let network: Box<dyn Network<T>> = match self {
            Self::Pan2021(config) => Box::new(Pan2021::new(init, config, standardisation)?),
            Self::Harvey2020(config) => Box::new(Harvey2020::new(init, config, standardisation)?),
            Self::Interpolation(_) => return Err(nothing_to_train("interpolation")),
            Self::LinearPositions(_) => return Err(nothing_to_train("linear_positions")),
            Self::ZeroVelocity(_) => return Err(nothing_to_train("zero_velocity")),
        };
        match init.exceeded() {
            None => Ok(network),
            Some(most) => Err(ModelError::TooLarge { most }),
        }
    }

    /// The frame of reference of the root's numbers in the windows that the network reads.
    pub fn root_frame(&self) -> RootFrame {
        match self {
            Self::Pan2021(config) => config.root_frame,
            _ => RootFrame::World,
        }
    }

    /// Whether what its network predicts is brought to the velocity factors that were asked for, see [`super::velocity_refinement`].
    pub fn refines_velocities(&self) -> bool {
        match self {
            Self::Pan2021(config) => config.velocity_refinement,
            _ => false,
        }
    }

    /// The same model, for the same weights, with its predictions brought to the velocity factors or not, where it can do so.
    pub fn refining_velocities(mut self, refining: bool) -> Self {
        if let Self::Pan2021(config) = &mut self {
            config.velocity_refinement = refining;
        }
        self
    }

    /// Whether some of its weights are [`Network::in_transformer`].
    pub fn has_transformers(&self) -> bool {
        match self {
            Self::Pan2021(config) => config.controllers == Controllers::Transformer,
            _ => false,
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
    pub fn untrained(&self, contact_threshold: f64) -> Option<Box<dyn TransitionModel>> {
        match self {
            Self::Interpolation(_) => Some(Box::new(Interpolation { contact_threshold })),
            Self::LinearPositions(_) => Some(Box::new(LinearPositions { contact_threshold })),
            Self::ZeroVelocity(_) => Some(Box::new(ZeroVelocity { contact_threshold })),
            Self::Pan2021(_) | Self::Harvey2020(_) => None,
        }
    }
}

fn nothing_to_train(model: &str) -> ModelError {
    ModelError::Model {
        model: model.into(),
        reason: "has no weights and needs no training; evaluate its config as it is".into(),
    }
}

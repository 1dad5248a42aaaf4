//! The models by the name that a config gives them.

use serde::{Deserialize, Serialize};

use super::{ModelError, Network};
use crate::autograd::Real;
use crate::data::Standardisation;
use crate::nn::Initialiser;

/// The `[model]` table of an experiment's config.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ModelConfig {
    Pan2021(Pan2021Config),
    Interpolation,
}

impl Default for ModelConfig {
    fn default() -> Self {
        Self::Pan2021(Pan2021Config::default())
    }
}

/// Fields of the network of Pan et al. 2021.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pan2021Config {
    pub lstms: usize,
}

impl Default for Pan2021Config {
    fn default() -> Self {
        Self { lstms: 2 }
    }
}

impl ModelConfig {
    /// # Errors
    /// The model has nothing to train.
    pub fn build<T: Real, R: rand::Rng>(
        &self,
        _init: &mut Initialiser<'_, T, R>,
        _standardisation: &Standardisation,
    ) -> Result<Box<dyn Network<T>>, ModelError> {
        Err(ModelError::Model {
            model: "pan2021".into(),
            reason: "not built".into(),
        })
    }
}

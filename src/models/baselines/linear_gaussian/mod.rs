//! The baseline "linear_gaussian": the next frames of a dance as a linear function of those before,
//! and a Gaussian error (spec of Valle-Pérez et al., section 6: what a flow must beat).
//!
//! - `settings`: the tables of a config;
//! - `fit`: the function and its error, fitted to training clips;
//! - `generator`: likelihoods by them, and dances that are drawn from them.

mod fit;
mod generator;
mod settings;

use toml::Table;

use crate::evaluation::sampled_dance::VALLEPEREZ2021;
use crate::models::settings::{ModelKind, ModelSettings, Paper};
use settings::Settings;

const NAME: &str = "linear_gaussian";

/// The line of the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinearGaussianKind;

impl ModelKind for LinearGaussianKind {
    fn name(&self) -> &str {
        NAME
    }

    fn papers(&self) -> Vec<Paper> {
        vec![VALLEPEREZ2021]
    }

    fn defaults(&self) -> Table {
        // The defaults hold numbers that TOML has, which a test proves of every kind.
        Table::try_from(Settings::default()).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<Settings>()?))
    }
}

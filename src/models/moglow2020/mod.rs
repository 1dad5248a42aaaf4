//! MoGlow (Henter et al. 2020), as Valle-Pérez et al. 2021 compare with it: each frame sampled from a
//! normalising flow whose couplings are LSTMs over time.
//!
//! - `config`: sizes;
//! - `flow`, `coupling`: blocks of norm, linear layer and LSTM coupling, and the likelihood;
//! - `task`: sequences that are trained, `generator`: dances that are sampled.

mod config;
mod coupling;
mod flow;
mod generator;
mod settings;
mod task;

pub use config::{MoglowConfig, MoglowSettings};
pub use flow::{Moglow2020, SequenceBatch, States};
pub use generator::TrainedMoglow;

use toml::Table;

use crate::evaluation::sampled_dance::VALLEPEREZ2021;
use crate::models::settings::{ModelKind, ModelSettings, Paper};

/// The line of the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moglow2020Kind;

impl ModelKind for Moglow2020Kind {
    fn name(&self) -> &str {
        "moglow2020"
    }

    fn default_name(&self) -> &str {
        "moglow"
    }

    fn papers(&self) -> Vec<Paper> {
        vec![VALLEPEREZ2021]
    }

    fn defaults(&self) -> Table {
        // The defaults hold numbers that TOML has, which a test proves.
        Table::try_from(MoglowSettings::default()).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<MoglowSettings>()?))
    }
}

//! Single-shot motion completion (Duan et al. 2022), as Li et al. compare with it: a Transformer
//! over frames that completes a whole window at once.
//!
//! Its authors published no program; what is known of it fixes the parts, and the sizes are those
//! of the specification (`docs/li2023.md`).

mod config;
mod network;

pub use config::{Duan2022Config, Duan2022Settings};
pub use network::Duan2022;

use toml::Table;

use crate::models::li2023;
use crate::models::settings::{ModelKind, ModelSettings, Paper};

/// The line of the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Duan2022Kind;

impl ModelKind for Duan2022Kind {
    fn name(&self) -> &str {
        "duan2022"
    }

    fn default_name(&self) -> &str {
        "duan"
    }

    fn papers(&self) -> Vec<Paper> {
        vec![li2023::DANCE, li2023::LAFAN1]
    }

    fn defaults(&self) -> Table {
        // The defaults hold numbers that TOML has, which a test proves.
        Table::try_from(Duan2022Settings::default()).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<Duan2022Settings>()?))
    }
}

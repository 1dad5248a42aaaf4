//! Foot-constrained spatial-temporal Transformer for keyframe-based complex motion synthesis (Li et
//! al.).
//!
//! - `config`: sizes, ablations and open points;
//! - `network`: spatial and temporal encoders, mix embedding, decoders (figure 1);
//! - `root`: root trajectory reconstruction in the graph (eq. 7 to 11);
//! - `losses`: eq. 17 to 21.
//!
//! `docs/li2023.md` fixes shapes, names and units.

mod config;
mod losses;
mod network;
mod root;

pub use config::{
    ContactConfig, Input, Li2023Config, Li2023Settings, LossConfig, LossUnit, Reconstruction,
    RootConfig, RootWeights, StateDecoder, TargetMeeting,
};
pub use losses::losses;
pub use network::{Li2023, Output};
pub use root::reconstruct_root;

use toml::Table;

use crate::evaluation::in_betweening::InBetweening;
use crate::models::settings::{ModelKind, ModelSettings, Paper};
use crate::report::figures::li2023 as figures;

/// The line of the registry.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Li2023Kind;

impl ModelKind for Li2023Kind {
    fn name(&self) -> &str {
        "li2023"
    }

    fn default_name(&self) -> &str {
        "ours"
    }

    fn papers(&self) -> Vec<Paper> {
        vec![DANCE, LAFAN1]
    }

    fn defaults(&self) -> Table {
        // The defaults hold numbers that TOML has, which a test proves.
        Table::try_from(Li2023Settings::default()).unwrap_or_default()
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<Li2023Settings>()?))
    }
}

/// The paper's tables on its dance data.
pub const DANCE: Paper = Paper {
    name: "li2023",
    printed: include_str!("../../../experiments/li2023/paper.toml"),
    figures: Some(figures::draw),
    demo: None,
    by_name: |_, _| Vec::new(),
    protocols: |data, options| vec![Box::new(InBetweening::dance(data, options))],
};

/// The paper's tables on LaFAN1.
pub const LAFAN1: Paper = Paper {
    name: "li2023_lafan1",
    printed: include_str!("../../../experiments/li2023_lafan1/paper.toml"),
    figures: Some(figures::draw),
    demo: None,
    by_name: |_, _| Vec::new(),
    protocols: |data, options| vec![Box::new(InBetweening::lafan1(data, options))],
};

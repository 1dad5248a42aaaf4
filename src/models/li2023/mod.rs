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

use crate::evaluation::in_betweening::InBetweening;
use crate::models::kind::{KindOf, Paper};
use crate::models::rotations::RotationSettings as _;
use crate::report::figures::li2023 as figures;

/// The line of the registry.
pub const KIND: KindOf<Li2023Settings> =
    KindOf::new(Li2023Settings::KIND, || PAPERS.to_vec()).called("ours");

/// The paper on all its data.
pub const PAPERS: [Paper; 3] = [DANCE, LAFAN1, MARTIAL];

/// The paper's tables on its dance data.
pub const DANCE: Paper = Paper {
    figures: Some(figures::draw),
    ..Paper::new(
        "li2023",
        include_str!("../../../experiments/li2023/paper.toml"),
        |data, options| vec![Box::new(InBetweening::dance(data, options))],
    )
};

/// Its figures on martial arts, of which it prints no numbers.
pub const MARTIAL: Paper = Paper {
    figures: Some(figures::draw),
    ..Paper::new(
        "li2023_martial",
        include_str!("../../../experiments/li2023_martial/paper.toml"),
        |data, options| vec![Box::new(InBetweening::dance(data, options))],
    )
};

/// The paper's tables on LaFAN1.
pub const LAFAN1: Paper = Paper {
    figures: Some(figures::draw),
    ..Paper::new(
        "li2023_lafan1",
        include_str!("../../../experiments/li2023_lafan1/paper.toml"),
        |data, options| vec![Box::new(InBetweening::lafan1(data, options))],
    )
};

//! Transflower (Valle-Pérez et al. 2021): dance to music, each frame sampled from a normalising flow
//! that is conditioned by a Transformer on past motion and on music.
//!
//! - `config`: sizes, ablations and open points;
//! - `encoder`: motion, audio and cross-modal Transformers (section 4.1);
//! - `flow`, `coupling`: blocks of norm, linear layer and attention coupling (section 4.2);
//! - `network`: both, the likelihood, and the deterministic baseline;
//! - `target`: what of a frame is modelled (ours);
//! - `task`: windows that are trained, `generator`: dances that are sampled.
//!
//! `docs/valleperez2021.md` fixes shapes, names and units.

mod config;
mod coupling;
mod encoder;
mod flow;
mod generator;
mod network;
mod settings;
mod target;
mod task;

pub use config::{
    CrossPositions, Head, LinearInit, TargetKind, ValleperezConfig, ValleperezSettings,
};
pub use flow::{Flow, FlowOutput};
pub use generator::TrainedValleperez;
pub use network::{Valleperez2021, WindowBatch};
pub use target::Target;

use crate::evaluation::sampled_dance::VALLEPEREZ2021;
use crate::models::kind::KindOf;

/// The line of the registry.
pub const KIND: KindOf<ValleperezSettings> =
    KindOf::new("valleperez2021", || vec![VALLEPEREZ2021]).called("transflower");

//! Transflower (Valle-Pérez et al. 2021): dance to music, each frame sampled from a normalising flow
//! that is conditioned by a Transformer on past motion and on music.

mod config;
mod coupling;
mod encoder;
mod flow;
mod network;
mod target;

pub use config::{
    CrossPositions, Head, LinearInit, TargetKind, ValleperezConfig, ValleperezSettings,
};
pub use flow::{Flow, FlowOutput};
pub use network::{Valleperez2021, WindowBatch};
pub use target::Target;

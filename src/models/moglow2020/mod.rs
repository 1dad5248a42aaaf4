//! MoGlow (Henter et al. 2020), as Valle-Pérez et al. 2021 compare with it: each frame sampled from a
//! normalising flow whose couplings are LSTMs over time.

mod config;
mod coupling;
mod flow;

pub use config::{MoglowConfig, MoglowSettings};
pub use flow::{Moglow2020, SequenceBatch};

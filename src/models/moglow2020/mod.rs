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

use crate::evaluation::sampled_dance::VALLEPEREZ2021;
use crate::models::kind::KindOf;

/// The line of the registry.
pub const KIND: KindOf<MoglowSettings> =
    KindOf::new("moglow2020", || vec![VALLEPEREZ2021]).called("moglow");

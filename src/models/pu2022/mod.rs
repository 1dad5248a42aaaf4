//! Music-driven dance regeneration with controllable key pose constraints (Pu and Shan 2022): a
//! dance from a song, a seed of motion and a few key poses.
//!
//! - `config`: sizes, ablations and open points;
//! - `window`: a window in numbers (section 3.1), `batch`: several as arrays, with local positions
//!   (eq. 8 to 10) and the weights of frames (eq. 15);
//! - `network`: encoders, cross-modal Transformer (eq. 5, 6, 11), loss (eq. 14);
//! - `clips`, `task`: the windows that are trained;
//! - `generator`: windows that slide over a song.
//!
//! `docs/pu2022.md` fixes shapes, names and units.

mod batch;
mod clips;
mod config;
mod generator;
mod made_up;
mod network;
mod settings;
mod task;
mod window;

pub use batch::{Batch, GivenWindow, frame_weights};
pub use clips::{DrawnWindow, MusicStatistics, draw, draw_keys};
pub use config::{
    AugmentationConfig, LossConfig, MusicConfig, MusicSpan, Norm, Pu2022Config, Pu2022Settings,
    ScheduleConfig, WindowConfig,
};
pub use generator::TrainedPu2022;
pub use network::Pu2022;
pub use window::{WindowFrame, pose_of};

use crate::evaluation::music_dance::PU2022;
use crate::models::kind::KindOf;

/// The line of the registry.
pub const KIND: KindOf<Pu2022Settings> = KindOf::new("pu2022", || vec![PU2022]);

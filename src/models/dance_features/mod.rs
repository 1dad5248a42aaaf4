//! Dances as standardised columns of motion and music, frame by frame at 20 a second: what the
//! models that sample a dance pose by pose share (Valle-Pérez et al. 2021; spec, sections 1 to 3).
//!
//! - [`config`]: the tables of a config;
//! - [`joints`]: which joints' rotations are columns, and what they are measured from;
//! - [`music`]: what is heard of a recording, and the columns made of it;
//! - [`scale`]: means and deviations;
//! - [`features`]: all of it, fitted to the training part, saved and read back;
//! - [`pieces`]: the parts of a data set in these numbers;
//! - [`windows`]: at which frames there is a window, [`epochs`]: in which order they are trained,
//!   [`training`]: both, of the training pieces;
//! - [`given`]: from a request to these numbers, and back to a dance; [`sampled`]: a dance that
//!   grows;
//! - [`mod@made_up`]: generated dances, for timings.

pub mod config;
pub mod epochs;
pub mod features;
pub mod given;
pub mod joints;
pub mod made_up;
pub mod music;
pub mod pieces;
pub mod sampled;
pub mod scale;
pub mod training;
pub mod windows;

pub use config::{Audio, AugmentationConfig, FeaturesConfig, GenerationConfig, ScheduleConfig};
pub use epochs::{Epochs, PieceWindow};
pub use features::{DanceFeatures, fit_motion};
pub use given::GivenDance;
pub use made_up::{Endless, MadeUp, made_up};
pub use music::{AudioColumns, heard, heard_by};
pub use pieces::{DanceData, Piece, with_noise};
pub use sampled::SampledFrames;
pub use scale::Scale;
pub use training::{TrainingWindow, TrainingWindows};
pub use windows::Contexts;

//! Dances as standardised columns of motion and music, frame by frame at 20 a second: what the
//! models that sample a dance pose by pose share (Valle-Pérez et al. 2021; spec, sections 1 to 3).
//!
//! - [`config`]: the tables of a config;
//! - [`joints`]: which joints' rotations are columns, and what they are measured from;
//! - [`music`]: what is heard of a recording, and the columns made of it;
//! - [`scale`]: means and deviations;
//! - [`features`]: all of it, fitted to the training part, saved and read back;
//! - [`pieces`]: the parts of a data set in these numbers;
//! - [`windows`]: at which frames there is a window;
//! - [`given`]: from a request to these numbers, and back to a dance.

pub mod config;
pub mod features;
pub mod given;
pub mod joints;
pub mod music;
pub mod pieces;
pub mod scale;
pub mod windows;

pub use config::{Audio, AugmentationConfig, FeaturesConfig};
pub use features::DanceFeatures;
pub use given::GivenDance;
pub use music::{AudioColumns, heard, heard_by};
pub use pieces::{DanceData, Piece};
pub use scale::Scale;
pub use windows::Contexts;

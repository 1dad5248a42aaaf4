//! Data sets: clips become features, a split, standardised numbers and windows.

pub mod choreography;
pub mod config;
pub mod dataset;
pub mod ranges;
pub mod root_frame;
mod split;
pub mod standardise;
pub mod window;
pub mod windows;

pub use config::{DataConfig, Split};
pub(crate) use dataset::hexadecimal;
pub use dataset::{DanceClip, DataError, Dataset};
pub use ranges::DataRanges;
pub use root_frame::RootFrame;
pub use standardise::Standardisation;
pub use window::window_features;
pub use windows::{Window, Windows, windows};

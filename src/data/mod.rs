//! Data sets: clips become features and a split.

pub mod choreography;
pub mod config;
pub mod dataset;
mod part;
mod split;

pub use config::{DataConfig, Split};
pub(crate) use dataset::hexadecimal;
pub use dataset::{DanceClip, DataError, Dataset};
pub use part::{DataPart, EmptyPart};

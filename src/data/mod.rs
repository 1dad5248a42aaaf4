//! Data sets: files become recordings, recordings a split.

pub mod choreography;
pub mod config;
pub mod dataset;
mod part;
mod split;

pub use config::{DataConfig, Split};
pub(crate) use dataset::hexadecimal;
pub use dataset::{DataError, Dataset, Recording};
pub use part::{DataPart, EmptyPart};

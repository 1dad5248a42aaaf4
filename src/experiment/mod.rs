//! Experiments: configs in layers.

pub mod config;
mod layers;

pub use config::{CheckpointConfig, ExperimentConfig, LogConfig, ValidationConfig};
pub use layers::ConfigError;

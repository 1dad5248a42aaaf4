//! Experiments: configs in layers.

pub mod config;
pub(crate) mod layers;

pub use config::{
    AugmentationConfig, CheckpointConfig, ExperimentConfig, LogConfig, ScheduleConfig,
    ScheduledSamplingConfig, ValueError,
};
pub use layers::ConfigError;

//! Experiments: configs in layers, and the tables that many of them make.

pub mod config;
mod curves;
mod error;
mod evaluated;
#[cfg(feature = "cli")]
mod event_file;
mod layers;
mod report;
mod reproduce;
mod results;
pub mod rows;
mod scoring;
mod tasks;

pub use config::{CheckpointConfig, ExperimentConfig, LogConfig, ValidationConfig};
pub use curves::Curves;
pub use error::ReproduceError;
pub use evaluated::EvaluatedRun;
pub use layers::ConfigError;
pub use reproduce::{Ending, Observer, Reproduction, StepObserver};
pub use rows::{Row, Seeds};
pub use scoring::{Scoring, ScoringChoice};

//! Training: curriculum, scheduled sampling, the loop, checkpoints.
//!
//! An [`ExperimentConfig`] and a data set make a [`Trainer`]: its [`Schedule`] says which windows are trained when, each step
//! cuts them into a batch, runs the shards of the batch on tapes of their own and moves the weights. A [`RunFolder`] keeps the
//! config, a manifest, a log of every loss and checkpoints, from which the training goes on to the bit.

pub mod checkpoint;
pub mod config;
mod config_file;
mod durable;
mod error;
pub mod manifest;
mod run_folder;
mod schedule;
pub mod state;
mod step;
mod streams;
mod trainer;

pub use config::{
    CheckpointConfig, ExperimentConfig, LogConfig, ScheduleConfig, ScheduledSamplingConfig,
    ValueError,
};
pub use config_file::ConfigError;
pub use durable::FileError;
pub use error::TrainingError;
pub use manifest::{Manifest, RunState};
pub use run_folder::RunFolder;
pub use schedule::{BatchPlan, Schedule};
pub use step::StepReport;
pub use streams::Streams;
pub use trainer::{Outcome, Resumed, Trainer};

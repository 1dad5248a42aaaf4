//! Training: curriculum, scheduled sampling, the loop, checkpoints.
//!
//! An [`ExperimentConfig`] and a data set make a [`Trainer`]: its [`Schedule`] says which windows are trained when, each step
//! cuts them into a batch, runs the shards of the batch on tapes of their own and moves the weights. A [`RunFolder`] keeps the
//! config, a manifest, a log of every loss and checkpoints, from which the training goes on to the bit.

mod augmentation;
pub mod checkpoint;
pub mod config;
mod config_file;
mod durable;
mod error;
mod lock;
mod log;
pub mod manifest;
pub mod measure;
mod run_folder;
mod run_status;
mod schedule;
mod single_frames;
pub mod state;
mod step;
mod streams;
mod trained_model;
mod trainer;
mod validation;

pub use config::{
    AugmentationConfig, CheckpointConfig, ExperimentConfig, LogConfig, ScheduleConfig,
    ScheduledSamplingConfig, ValueError,
};
pub use config_file::ConfigError;
pub use durable::FileError;
pub(crate) use durable::replace as replace_file;
pub use error::TrainingError;
pub use log::LogLine;
pub use manifest::{Manifest, RunState};
pub use run_folder::RunFolder;
pub use run_status::{RunProgress, RunStatus};
pub use schedule::{BatchPlan, Schedule};
pub use step::StepReport;
pub use streams::Streams;
pub use trainer::{Outcome, Resumed, Trainer};
pub use validation::ValidationConfig;

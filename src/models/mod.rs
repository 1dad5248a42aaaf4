//! Models: one folder a paper, and the one list of them.
//!
//! - [`task`]: what training asks of a model;
//! - [`generator`]: what a user, an evaluation or `generate` may ask of one;
//! - [`inference`]: weights that answer;
//! - [`exported_batch`]: a batch with a model's results, for comparison;
//! - [`settings`]: what the commands ask of a kind of model;
//! - [`registry`]: the list of kinds;
//! - [`transition`]: what the models of transitions between two keyframes share;
//! - [`rotations`]: what the models of rotations on any skeleton share;
//! - [`flow`]: what normalising flows share;
//! - [`dance_features`]: what the models that sample a dance pose by pose share.

#[cfg(feature = "papers")]
pub mod baselines;
#[cfg(feature = "papers")]
pub mod dance_features;
#[cfg(feature = "papers")]
pub mod duan2022;
pub mod exported_batch;
#[cfg(feature = "papers")]
pub mod flow;
#[cfg(feature = "papers")]
mod forms;
pub mod generator;
pub mod gradient_report;
#[cfg(feature = "papers")]
pub mod harvey2020;
pub mod inference;
pub mod kind;
#[cfg(feature = "papers")]
pub mod li2023;
#[cfg(feature = "papers")]
pub mod moglow2020;
#[cfg(feature = "papers")]
pub mod pan2021;
#[cfg(feature = "papers")]
pub mod pu2022;
pub mod registry;
#[cfg(feature = "papers")]
pub mod rotations;
#[cfg(feature = "papers")]
mod scratch;
pub mod settings;
mod shards;
mod statistics;
pub mod streams;
pub mod task;
#[cfg(feature = "papers")]
pub mod transition;
#[cfg(feature = "papers")]
pub mod valleperez2021;
pub mod watched;
pub mod weights;

#[cfg(feature = "papers")]
pub use forms::AugmentationConfig;
pub use generator::{Generator, ModelError, Motion, Request};
pub use kind::{KindOf, ModelKind, Paper};
pub use settings::{ModelSettings, TaskSetting};
pub use shards::Shards;
pub use statistics::Statistics;
pub use streams::Streams;
pub use task::{CRITICS, LossTerms, Meeting, Step, Task, Watched};

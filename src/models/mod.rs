//! Models: one folder a paper, and the one list of them.

pub mod baselines;
pub mod harvey2020;
pub mod pan2021;
pub mod registry;
pub mod streams;
pub mod transition;
pub mod weights;

pub use registry::ModelConfig;
pub use streams::Streams;
pub use transition::{LossTerms, ModelError};

//! Training: the loop over a task's steps.
//!
//! An [`ExperimentConfig`](crate::experiment::ExperimentConfig) and a data set make a [`Trainer`].
//! Its task says what each step trains; the shards of a step run on tapes of their own, and Adam
//! moves the weights by the sum of their gradients. Everything that goes on is kept in a
//! [`RunFolder`](crate::run::RunFolder), from which a training goes on to the bit.

mod best;
mod error;
mod losses;
pub mod measure;
mod meeting;
mod record;
mod report;
mod resume;
mod step;
mod trainer;
mod validation;

pub use error::TrainingError;
pub use report::StepReport;
pub use resume::Resumed;
pub use step::pool;
pub use trainer::{Outcome, Trainer};

//! Training: the loop over a task's steps.
//!
//! An [`ExperimentConfig`](crate::experiment::ExperimentConfig) and a data set make a [`Trainer`].
//! Its task says what each [`step`](crate::step) trains. Everything that goes on is kept in a
//! [`RunFolder`](crate::run::RunFolder), from which a training goes on to the bit.

mod best;
mod error;
mod record;
mod report;
mod resume;
mod trainer;
mod validation;

pub use error::TrainingError;
pub use report::StepReport;
pub use resume::Resumed;
pub use trainer::{Outcome, Trainer};

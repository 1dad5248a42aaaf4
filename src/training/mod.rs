//! Training: the loop over steps, and its end.

pub(crate) mod error;
pub mod measure;
pub(crate) mod step;
mod trainer;
pub(crate) mod validation;

pub use error::TrainingError;
pub use step::StepReport;
pub use trainer::{Outcome, Resumed, Trainer};
pub use validation::ValidationConfig;

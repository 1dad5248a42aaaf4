//! Evaluation: the paper's three scores of a model, by a frozen protocol, and the tables that set them beside the paper's.

pub mod effect;
pub mod metrics;
pub mod paper;
pub mod protocol;
mod record;
pub mod scores;
pub mod tables;
pub mod window_request;

pub use effect::{
    FOLLOWED, Response, body_distance, mean_rows, mean_velocity_factors, root_response,
};
pub use metrics::{WindowScores, window_scores};
pub use protocol::{EvaluationError, Outcome, Protocol, SkippedClip};
pub use record::{EvaluatedData, EvaluationRecord, RecordError};
pub use scores::{Evaluation, LengthScores};
pub use tables::{TableRow, markdown_tables, terminal_tables};
pub use window_request::window_request;

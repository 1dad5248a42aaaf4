//! Evaluation: frozen protocols that score a model, and the tables that set its scores beside a
//! paper's.

#[cfg(feature = "papers")]
pub mod equations;
#[cfg(feature = "papers")]
pub mod exports;
#[cfg(feature = "papers")]
pub mod frechet;
#[cfg(feature = "papers")]
pub mod in_betweening;
mod metric;
#[cfg(feature = "papers")]
pub mod music_dance;
#[cfg(feature = "papers")]
pub mod pair_distance;
mod printed;
pub mod protocol;
mod protocol_table;
#[cfg(feature = "papers")]
pub mod published;
mod record;
#[cfg(feature = "papers")]
pub mod sampled_dance;
pub mod scores;
pub mod tables;
#[cfg(feature = "papers")]
pub mod transitions;
#[cfg(feature = "papers")]
mod windows;

pub use metric::{Better, Metric};
pub use printed::{PrintedError, PrintedRow, PrintedTable, PrintedTables};
pub use protocol::{Evaluation, EvaluationError, EvaluationOptions, Protocol};
pub use record::{EvaluatedData, EvaluationRecord, RecordError};
pub use scores::{ProtocolScores, ScoreRow, Scores};
pub use tables::{TableRow, Tables};

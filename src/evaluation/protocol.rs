//! A frozen way of scoring a model: which windows, what is given, which metrics.

use thiserror::Error;

use super::{Metric, Scores};
use crate::counted::counted;
use crate::data::{DataPart, Dataset, EmptyPart};
use crate::models::{Generator, ModelError};

/// A way of scoring.
pub trait Protocol: Send + Sync {
    /// Its name, by which scores, tables and a paper's numbers know it.
    fn name(&self) -> &'static str;

    /// How it counts, in a few words for a caption.
    fn about(&self) -> &'static str;

    /// Its metrics, in the order of their tables.
    fn metrics(&self) -> &[Metric];

    /// The lengths that it scores at, frames; none where it has no such choice.
    fn lengths(&self) -> &[usize] {
        &[]
    }

    /// What the number of a column counts, as tables call it.
    fn number(&self) -> &'static str {
        "N"
    }

    /// Frames of all requests that a model will be asked on recordings of these numbers of frames,
    /// one for each likelihood: how far an evaluation has to go.
    fn frames(&self, recordings: &[usize]) -> u64;

    /// Scores a model on a part of the data. The scores are the same to the bit on any number of
    /// threads.
    ///
    /// # Errors
    /// Data without a window, or a model that fails or gives something that does not fit.
    fn evaluate(
        &self,
        subject: &dyn Generator,
        data: &Dataset,
        part: DataPart,
    ) -> Result<Evaluation, EvaluationError>;
}

/// What may be chosen of a protocol; scores by another choice are not comparable with its own.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct EvaluationOptions {
    /// Lengths to score at, frames; none: its own.
    pub lengths: Vec<usize>,
    /// At most this many windows of each length, spread evenly over all of them; none: all.
    pub most_windows: Option<usize>,
}

/// Scores, and what is to be known of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Evaluation {
    pub scores: Scores,
    /// What was left out, each a warning to print.
    pub warnings: Vec<String>,
}

impl EvaluationError {
    /// Whether it ended because its model was told to stop.
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Model { source, .. } if matches!(**source, ModelError::Stopped))
    }
}

/// Why there are no scores.
#[derive(Debug, Error)]
pub enum EvaluationError {
    #[error(
        "no clip has the {needed} frames of a window at N = {length} (the longest of {} has {longest}); give longer \
         clips or leave this length out",
        counted(*clips, "clip")
    )]
    NoWindows {
        length: usize,
        needed: usize,
        clips: usize,
        longest: usize,
    },
    #[error(transparent)]
    Part(#[from] EmptyPart),
    /// What the protocol cannot measure, and why.
    #[error("{reason}")]
    Data { reason: String },
    /// A model that fails, or gives something that does not fit.
    #[error("{what}")]
    Model {
        /// Its name, and what it was asked for.
        what: String,
        source: Box<ModelError>,
    },
}

/// Those of a model's protocols that are named, all where none is.
///
/// # Errors
/// A name that none of them has; lengths that were asked for of a protocol without any.
pub fn choose(
    mut protocols: Vec<Box<dyn Protocol>>,
    names: &[String],
    with_lengths: bool,
) -> Result<Vec<Box<dyn Protocol>>, EvaluationError> {
    let known: Vec<&str> = protocols.iter().map(|protocol| protocol.name()).collect();
    let refused = |reason| Err(EvaluationError::Data { reason });
    if let Some(name) = names.iter().find(|name| !known.contains(&&***name)) {
        let known = known.join(", ");
        return refused(format!(
            "--protocol {name}: the model has no such protocol; it has {known}"
        ));
    }
    protocols.retain(|it| names.is_empty() || names.iter().any(|name| name == it.name()));
    let without = protocols.iter().find(|it| it.lengths().is_empty());
    match without.filter(|_| with_lengths) {
        Some(protocol) => {
            let name = protocol.name();
            refused(format!("--lengths: the protocol {name} has no lengths"))
        }
        None => Ok(protocols),
    }
}

//! Why there is nothing to show.

use crate::data::choreography::ChoreographyError;
use crate::data::{DataError, EmptyPart};
use crate::evaluation::{EvaluationError, PrintedError, RecordError};
use crate::experiment::ConfigError;
use crate::models::ModelError;
use crate::models::settings::ValueError;
use crate::motion::bvh::BvhError;
use crate::motion::fit::RotationFitError;
use crate::run::{FileError, RunError};
#[cfg(feature = "papers")]
use crate::synthesis::SynthesisError;
#[cfg(feature = "papers")]
use crate::synthesis::song::SongError;

/// Why a figure cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FigureError {
    #[error("the figure {figure:?} has nothing to draw: {what}")]
    Empty { figure: String, what: &'static str },
    #[error("the figure {figure:?}: {series} has a NaN or an infinity")]
    NotFinite { figure: String, series: String },
    /// Parts of a figure that do not go together: which, and why.
    #[error("{0}")]
    Unfit(String),
}

impl FigureError {
    pub(super) fn empty(figure: &str, what: &'static str) -> Self {
        let figure = figure.into();
        Self::Empty { figure, what }
    }

    pub(super) fn not_finite(figure: &str, series: &str) -> Self {
        let (figure, series) = (figure.into(), series.into());
        Self::NotFinite { figure, series }
    }

    /// A row that has other frames than the first.
    pub(super) fn frames(figure: &str, row: &str, found: usize, expected: usize) -> Self {
        Self::Unfit(format!(
            "the figure {figure:?}: {row} has {found} frames, the first row has {expected}; rows \
             show the same frames"
        ))
    }
}

/// Why a demo or a paper's figures cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// What is asked for cannot be shown: what, and what can.
    #[error("{0}")]
    Refused(String),
    #[error("--fraction is not a share of the schedule")]
    Fraction(#[source] ValueError),
    /// The figures' scores of a model, by its name.
    #[error("{model}")]
    Scores { model: String, source: ModelError },
    #[error("the numbers of a figure")]
    Numbers(#[from] csv::Error),
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    #[error(transparent)]
    Printed(#[from] PrintedError),
    #[error(transparent)]
    Record(#[from] RecordError),
    #[cfg(feature = "papers")]
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    #[cfg(feature = "papers")]
    #[error(transparent)]
    Song(#[from] Box<SongError>),
    #[error(transparent)]
    Rotations(#[from] RotationFitError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Choreography(#[from] ChoreographyError),
    #[error(transparent)]
    Data(#[from] DataError),
    #[error(transparent)]
    EmptyPart(#[from] EmptyPart),
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error(transparent)]
    Toml(#[from] toml::ser::Error),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    File(#[from] FileError),
}

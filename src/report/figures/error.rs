//! Why a paper's figures cannot be drawn.

use crate::models::ModelError;
use crate::report::FigureError;
use crate::run::{FileError, RunError};
use crate::synthesis::SynthesisError;

#[derive(Debug, thiserror::Error)]
pub enum FiguresError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(
        "{other} was made for data at another rate, or with another mapping, contact threshold or facing_sigma than {subject}: \
         they cannot be compared"
    )]
    OtherFeatures { subject: String, other: String },
    #[error(
        "no test clip has the {needed} frames of --length {length} (the longest has {longest})"
    )]
    TooShort {
        length: usize,
        needed: usize,
        longest: usize,
    },
    #[error(
        "--clip {name} is not among the test clips with {needed} frames or more: {}",
        clips.join(", ")
    )]
    NoClip {
        name: String,
        needed: usize,
        clips: Vec<String>,
    },
    #[error(
        "--start {start}: {clip} has {frames} frames, so a window of {needed} starts at frame {last} at the latest"
    )]
    Start {
        start: usize,
        clip: String,
        frames: usize,
        needed: usize,
        last: usize,
    },
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    #[error("{model}")]
    Scores { model: String, source: ModelError },
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error("the numbers of a figure")]
    Numbers(#[from] csv::Error),
    #[error(transparent)]
    File(#[from] FileError),
}

//! What there is to say of a dance: as text and as JSON.

use std::fmt;

use serde::Serialize;

use crate::synthesis::song::SongSummary;
use crate::synthesis::{CompletionSummary, Summary};

/// The numbers of a dance, by what it was made from.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum DanceSummary {
    Sequence(Summary),
    Completion(CompletionSummary),
    Song(SongSummary),
}

impl fmt::Display for DanceSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sequence(summary) => summary.fmt(f),
            Self::Completion(summary) => summary.fmt(f),
            Self::Song(summary) => summary.fmt(f),
        }
    }
}

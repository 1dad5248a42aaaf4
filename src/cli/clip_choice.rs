//! `--clips`: which part of a data set is looked at.

use std::fmt;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::data::{DanceClip, Dataset};

/// A part of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ClipChoice {
    /// The clips that results are reported on; nothing is chosen by them
    #[default]
    Test,
    /// Training clips that data.validation_share sets aside, to choose settings by
    Validation,
    /// The clips that are trained on
    Train,
}

impl ClipChoice {
    /// The clips of that part.
    ///
    /// # Errors
    /// There are none; the error says which key gives some.
    pub fn of(self, dataset: &Dataset) -> anyhow::Result<&[DanceClip]> {
        let clips = match self {
            Self::Test => &dataset.test,
            Self::Validation => &dataset.validation,
            Self::Train => &dataset.train,
        };
        if clips.is_empty() {
            let key = match self {
                Self::Validation => "data.validation_share",
                Self::Test | Self::Train => "data.split",
            };
            anyhow::bail!("the config's {key} leaves no {self} clips");
        }
        Ok(clips)
    }

    /// Whether these are the test clips.
    pub fn is_test(&self) -> bool {
        *self == Self::Test
    }
}

impl fmt::Display for ClipChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Test => "test",
            Self::Validation => "validation",
            Self::Train => "training",
        })
    }
}

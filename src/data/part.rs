//! Which part of a data set is looked at.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{Dataset, Recording};

/// A part of a data set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum DataPart {
    /// The clips that results are reported on; nothing is chosen by them.
    #[default]
    Test,
    /// Training clips that data.validation_share sets aside, to choose settings by.
    Validation,
    /// The clips that are trained on.
    Train,
}

/// A part without clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the config's {key} leaves no {part} clips")]
pub struct EmptyPart {
    pub part: DataPart,
    /// The key that gives some.
    pub key: &'static str,
}

impl DataPart {
    /// The clips of that part.
    ///
    /// # Errors
    /// There are none; the error says which key gives some.
    pub fn of(self, dataset: &Dataset) -> Result<&[Recording], EmptyPart> {
        let (clips, key) = match self {
            Self::Test => (&dataset.test, "data.split"),
            Self::Validation => (&dataset.validation, "data.validation_share"),
            Self::Train => (&dataset.train, "data.split"),
        };
        if clips.is_empty() {
            return Err(EmptyPart { part: self, key });
        }
        Ok(clips)
    }

    /// Whether these are the test clips.
    pub fn is_test(&self) -> bool {
        *self == Self::Test
    }
}

impl fmt::Display for DataPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Test => "test",
            Self::Validation => "validation",
            Self::Train => "training",
        })
    }
}

//! `--clips`: which part of a data set is looked at.

use clap::ValueEnum;

use crate::data::DataPart;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum ClipChoice {
    /// The clips that results are reported on; nothing is chosen by them
    #[default]
    Test,
    /// Training clips that data.validation_share sets aside, to choose settings by
    Validation,
    /// The clips that are trained on
    Train,
}

impl From<ClipChoice> for DataPart {
    fn from(choice: ClipChoice) -> Self {
        match choice {
            ClipChoice::Test => Self::Test,
            ClipChoice::Validation => Self::Validation,
            ClipChoice::Train => Self::Train,
        }
    }
}

//! What can be wrong with a sound file.

use std::path::PathBuf;

use thiserror::Error;

use super::decode::LONGEST;
use super::resample::{HIGHEST_RATE, LOWEST_RATE};
use super::sound::{HOP, RATE};
use crate::counted::counted;

/// Why a sound cannot be heard.
#[derive(Debug, Error)]
pub enum MusicError {
    #[error("{path} cannot be read")]
    Read {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[error("{path} is {what}; give a sound file on disk (wav, flac, mp3 or ogg)")]
    NoFile { path: PathBuf, what: &'static str },
    #[error("{file} is empty")]
    Empty { file: String },
    /// The content is none of the formats, whatever the name's ending says.
    #[error(
        "{file} is {what}, not wav, flac, mp3 or ogg; where it is music, `ffmpeg -i \"{file}\" \
         music.flac` converts it (not a protected one)"
    )]
    OtherFormat { file: String, what: &'static str },
    #[error("{file} is damaged: {problem}")]
    Damaged { file: String, problem: String },
    #[error(
        "{file} is {container} with sound that keydance does not decode ({problem}); `ffmpeg -i \
         \"{file}\" music.flac` converts it"
    )]
    Codec {
        file: String,
        container: &'static str,
        problem: String,
    },
    #[error(
        "{file} has {rate} samples a second, keydance takes {LOWEST_RATE} to {HIGHEST_RATE}; \
         convert it to {RATE}"
    )]
    Rate { file: String, rate: u32 },
    #[error(
        "{file} changes from {before} to {after} samples a second; convert it to one rate or cut it \
         there"
    )]
    RateChange {
        file: String,
        before: u32,
        after: u32,
    },
    #[error(
        "{file} is longer than {} minutes, the most that is heard at once; cut it into parts",
        LONGEST / 60
    )]
    TooLong { file: String },
    #[error(
        "{file} has {}, less than the {HOP} of a frame (1/30 s at {RATE} Hz); give a longer sound",
        counted(*samples, "sample")
    )]
    TooShort { file: String, samples: usize },
    #[error("a sound cannot be brought to {RATE} Hz: {problem}")]
    Resampling { problem: String },
}

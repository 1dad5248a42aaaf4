//! Data sets: files become recordings, recordings a split.

pub mod choreography;
pub mod config;
pub mod dataset;
mod folder;
#[cfg(feature = "music")]
mod given_music;
mod listed;
mod mixed;
#[cfg(feature = "papers")]
pub mod motorica;
#[cfg(feature = "music")]
mod pairs;
mod part;
mod prepared;
mod reading;
mod source;
mod split;
mod twins;
mod windows;

pub use config::{BeatExtrema, DataConfig, Split};
pub use dataset::{DataError, Dataset, NamedFrames, Recording};
pub(crate) use dataset::{file_digest, hexadecimal};
pub(crate) use folder::{clip_files, is_clip};
#[cfg(feature = "music")]
pub use given_music::GivenMusic;
#[cfg(feature = "music")]
pub use pairs::music_beside;
#[cfg(feature = "papers")]
pub(crate) use pairs::{sound_files, sound_of};
pub use part::{DataPart, EmptyPart};
pub use prepared::{Prepared, Stored, StoredClip, is_prepared, prepare};
pub use reading::{FileReading, RigReading, at_its_rate};
pub use source::ClipSource;
pub use windows::{Window, WindowCut};

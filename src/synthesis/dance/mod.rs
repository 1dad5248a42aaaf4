//! A dance from files, by whatever model: between keyframes or to a song.

mod between_keyframes;
mod request;
mod summary;
mod to_song;

use thiserror::Error;

use super::controls::ControlError;
use super::keyframes::{KeyframeError, Keyframes};
use super::song::{Song, SongError};
use super::{Completion, Sequence, SequenceRequest, SynthesisError, SynthesisOptions};
use crate::counted::counted;
use crate::data::DataConfig;
use crate::models::generator::NeededPoses;
use crate::motion::bvh::{Bvh, BvhError};
use crate::motion::{Clip, Pose};
use crate::run::{RunError, Subject};

pub use request::DanceRequest;
pub use summary::DanceSummary;

/// Why there is no dance.
#[derive(Debug, Error)]
pub enum DanceError {
    /// What is asked for does not go together, or with the model: what, and what to do.
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    Keyframe(#[from] KeyframeError),
    #[error(transparent)]
    Control(#[from] ControlError),
    #[error("--contacts")]
    Contacts(#[source] SynthesisError),
    #[error(transparent)]
    Song(Box<SongError>),
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error("the motion cannot be written")]
    Document(#[source] BvhError),
}

impl From<SongError> for DanceError {
    fn from(error: SongError) -> Self {
        Self::Song(error.into())
    }
}

/// Keyframes and controls, and what a model of transitions made of them.
pub struct MadeSequence {
    pub keyframes: Keyframes,
    pub request: SequenceRequest,
    pub sequence: Sequence,
    pub options: SynthesisOptions,
}

/// What a dance was made from, as far as a page shows it.
pub enum Origin {
    Sequence(Box<MadeSequence>),
    /// Keyframes, and what a model that makes rotations made of them.
    Completion {
        keyframes: Vec<(usize, Pose)>,
        made: Box<Completion>,
    },
    Song {
        song: Box<Song>,
        dance: Clip,
    },
}

/// A dance that a model made.
pub struct Dance {
    /// The content of its file.
    pub document: Bvh,
    pub summary: DanceSummary,
    pub origin: Origin,
}

impl Dance {
    /// Refuses a model that dances on from poses before its first frame, which no file gives.
    ///
    /// # Errors
    /// It does.
    pub fn check_model(subject: &Subject) -> Result<(), DanceError> {
        let poses = subject.model.needs().poses;
        if let NeededPoses::Past(frames) | NeededPoses::Keyframes { past: frames @ 1.. } = poses {
            let (what, poses) = (&subject.what, counted(frames, "pose"));
            return Err(DanceError::Refused(format!(
                "{what} dances on from {poses}; generate makes motions between keyframes"
            )));
        }
        Ok(())
    }

    /// What a subject's model makes of a request, its files read as `data` says. What should be
    /// known of the files or of what was asked for is told to `warn` as it is found.
    ///
    /// # Errors
    /// A file or control that cannot be used, or that does not fit the model; a model that fails.
    pub fn make(
        subject: &Subject,
        request: &DanceRequest,
        data: &DataConfig,
        warn: &mut dyn FnMut(String),
    ) -> Result<Self, DanceError> {
        if let Some(song) = &request.song {
            return to_song::make(subject, request, song, data, warn);
        }
        match subject.model.needs().poses {
            NeededPoses::Seed(frames) => Err(DanceError::Refused(format!(
                "{} goes on from a seed of {} to music; give --music SONG and --seed-motion \
                 FILE.bvh",
                subject.what,
                counted(frames, "frame")
            ))),
            NeededPoses::Keyframes { .. } => {
                between_keyframes::complete(subject, request, data, warn)
            }
            _ => between_keyframes::synthesise(subject, request, data, warn),
        }
    }
}

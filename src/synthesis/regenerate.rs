//! New dances to the music of a recorded one, from random key poses of it: what Pu and Shan 2022
//! call regeneration.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::keyframes::FileKeyframe;
use super::song::{Seed, Song, SongChoice, SongError};
use crate::data::music_beside;
use crate::models::Streams;
use crate::models::pu2022::{Pu2022Settings, draw_keys};
use crate::music::Cache;
use crate::run::Subject;

/// Key frames of a dance of so many frames: window after window those that a training draws, none
/// nearer to the one before than it allows.
fn random_key_frames(
    settings: &Pu2022Settings,
    frames: usize,
    stream: &mut impl rand::Rng,
) -> Vec<usize> {
    let Pu2022Settings {
        window, schedule, ..
    } = settings;
    let mut keys: Vec<usize> = Vec::new();
    let mut start = 0;
    while start + window.seed < frames {
        for key in draw_keys(stream, window, schedule) {
            let (key, last) = (start + key, keys.last());
            let apart = last.is_none_or(|last| key >= last + schedule.key_pose_distance);
            if apart && key < frames {
                keys.push(key);
            }
        }
        start += window.generated();
    }
    keys
}

/// Why there are no new dances.
#[derive(Debug, Error)]
pub enum RegenerateError {
    #[error(
        "{what} is of kind {kind}: key poses are drawn as in the training of a model of kind pu2022"
    )]
    OtherKind { what: String, kind: String },
    #[error("{clip} has no sound file of its name beside it; give --music SONG")]
    NoMusic { clip: PathBuf },
    #[error(
        "new dances in {folder} would stand among the recorded ones; give another folder to --out"
    )]
    AmongRecorded { folder: PathBuf },
}

/// A recorded dance with its music, to which a model makes new ones.
pub struct Regeneration<'s> {
    settings: &'s Pu2022Settings,
    subject: &'s Subject,
    clip: &'s Path,
    music: PathBuf,
    /// What is drawn follows from it.
    seed: u64,
    cache: Cache,
}

impl<'s> Regeneration<'s> {
    /// New dances in `folder`; without `music`, to the file beside the recorded one.
    ///
    /// # Errors
    /// A model of another kind, a dance without music, the folder of the recorded dance.
    pub fn new(
        subject: &'s Subject,
        clip: &'s Path,
        music: Option<PathBuf>,
        folder: &Path,
        seed: u64,
    ) -> Result<Self, RegenerateError> {
        let settings = subject.config.model.downcast_ref::<Pu2022Settings>();
        let settings = settings.ok_or_else(|| RegenerateError::OtherKind {
            what: subject.what.clone(),
            kind: subject.config.model.kind().into(),
        })?;
        let no_music = || RegenerateError::NoMusic { clip: clip.into() };
        let music = music.or_else(|| music_beside(clip)).ok_or_else(no_music)?;
        let recorded = clip.parent().unwrap_or(Path::new("")).join(".");
        let recorded = recorded.canonicalize().ok();
        if recorded.is_some() && recorded == folder.canonicalize().ok() {
            let folder = folder.into();
            return Err(RegenerateError::AmongRecorded { folder });
        }
        Ok(Self {
            settings,
            subject,
            clip,
            music,
            seed,
            cache: Cache::of_user(),
        })
    }

    /// The `number`-th new dance, read and ready to be asked for: it goes on from the recorded
    /// one's beginning. Everything follows from the seed and `number`.
    ///
    /// # Errors
    /// As [`Song::read`]; a recorded dance no longer than the seed.
    pub fn song(&self, number: u64) -> Result<Song, SongError> {
        let Subject { model, config, .. } = self.subject;
        let choice = SongChoice {
            music: self.music.clone(),
            seed: Seed::Motion(self.clip.into(), Some(0)),
            key_poses: Vec::new(),
            frames: None,
            mapping: None,
        };
        let short = |found, needed| SongError::ShortDance {
            clip: self.clip.into(),
            found,
            needed,
        };
        let read = |choice: &SongChoice| Song::read(choice, &**model, &config.data, &self.cache);
        let plain = read(&choice).map_err(|error| match error {
            SongError::ShortSeed { found, needed, .. } => short(found, needed),
            other => other,
        })?;
        let frames = plain.request.frames.min(plain.seed_clip_frames());
        if frames <= plain.seed {
            return Err(short(frames, plain.seed));
        }
        let mut stream = Streams::new(self.seed).stream("regeneration", &[number]);
        let keys = random_key_frames(self.settings, frames, &mut stream);
        let key_poses = keys.into_iter().map(|frame| FileKeyframe {
            file: self.clip.into(),
            frame,
            time: frame,
        });
        read(&SongChoice {
            key_poses: key_poses.collect(),
            frames: Some(frames),
            ..choice
        })
    }
}

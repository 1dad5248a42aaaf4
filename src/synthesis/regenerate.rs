//! New dances to the music of a recorded one, from random key poses of it: what Pu and Shan 2022
//! call regeneration.

use std::path::Path;

use super::song::{Seed, Song, SongChoice, SongError};
use crate::data::DataConfig;
use crate::models::pu2022::{Pu2022Settings, draw_keys};
use crate::models::{Generator, Streams};
use crate::music::Cache;
use crate::synthesis::keyframes::FileKeyframe;

/// Key frames of a dance of so many frames: window after window those that a training draws, none
/// nearer to the one before than it allows.
pub fn random_key_frames(
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

/// The `number`-th new dance to the music of a recorded one, read and ready to be asked for: it
/// goes on from the recorded one's beginning. Everything follows from `seed` and `number`.
///
/// # Errors
/// As [`Song::read`]; a recorded dance no longer than the seed.
pub fn regeneration(
    settings: &Pu2022Settings,
    model: &dyn Generator,
    [clip, music]: [&Path; 2],
    data: &DataConfig,
    [seed, number]: [u64; 2],
    cache: &Cache,
) -> Result<Song, SongError> {
    let choice = SongChoice {
        music: music.into(),
        seed: Seed::Motion(clip.into(), Some(0)),
        key_poses: Vec::new(),
        frames: None,
        mapping: None,
    };
    let short = |found, needed| SongError::ShortDance {
        clip: clip.into(),
        found,
        needed,
    };
    let plain = Song::read(&choice, model, data, cache).map_err(|error| match error {
        SongError::ShortSeed { found, needed, .. } => short(found, needed),
        other => other,
    })?;
    let frames = plain.request.frames.min(plain.seed_clip_frames());
    if frames <= plain.seed {
        return Err(short(frames, plain.seed));
    }
    let mut stream = Streams::new(seed).stream("regeneration", &[number]);
    let keys = random_key_frames(settings, frames, &mut stream);
    let key_poses = keys.into_iter().map(|frame| FileKeyframe {
        file: clip.into(),
        frame,
        time: frame,
    });
    let choice = SongChoice {
        key_poses: key_poses.collect(),
        frames: Some(frames),
        ..choice
    };
    Song::read(&choice, model, data, cache)
}

//! What a model is asked for: a stretch of a dance from its seed, its key poses and its music.

use std::ops::Range;

use ndarray::Array2;

use crate::data::Recording;
use crate::models::generator::{Given, Request};
use crate::music::FeatureSet;

/// T', frames of the seed.
pub const SEED: usize = 60;
/// Frames from the seed's last to the first key pose, and from one to the next.
const KEY_EVERY: usize = 45;

/// Frames of a stretch of `frames` at which key poses are given, from 0: 104, 149, 194, ...
pub fn key_frames(frames: usize) -> impl Iterator<Item = usize> {
    (SEED - 1 + KEY_EVERY..frames).step_by(KEY_EVERY)
}

/// Asks for frames of a recording: given are the poses of the seed and of the key frames, and the
/// music where the model reads it.
///
/// Frames of the recording that the stretch lies in must be there. None where the music is asked
/// for and the recording has none.
pub(super) fn request(
    recording: &Recording,
    stretch: Range<usize>,
    music: Option<FeatureSet>,
    seed: u64,
) -> Option<Request> {
    let clip = &recording.clip;
    let poses = clip.poses.get(stretch.clone())?;
    let frames = (0..SEED).chain(key_frames(poses.len()));
    let given = frames.filter_map(|frame| {
        Some(Given {
            frame: frame as i64,
            pose: poses.get(frame)?.clone(),
            features: None,
        })
    });
    let music = match music {
        Some(set) => Some(heard(recording, stretch, set)?),
        None => None,
    };
    Some(Request {
        given: given.collect(),
        music,
        seed,
        ..Request::new(clip.skeleton.clone(), clip.frame_time, poses.len())
    })
}

/// Features of the music of a stretch, `[frames, numbers]`; beyond the music's end the last frame
/// repeats.
fn heard(recording: &Recording, stretch: Range<usize>, set: FeatureSet) -> Option<Array2<f64>> {
    let features = recording.music.as_ref()?.features(set);
    let last = features.nrows().checked_sub(1)?;
    let (first, frames) = (stretch.start, stretch.len());
    let at =
        |(frame, number): (usize, usize)| f64::from(features[[(first + frame).min(last), number]]);
    Some(Array2::from_shape_fn((frames, set.numbers()), at))
}

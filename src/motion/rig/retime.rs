//! A motion at another rate, with given frames on given frames.

use crate::motion::{Clip, Pose};

/// The frames nearest to given ones (ascending) where there are `ratio` times as many, each of them
/// another.
pub fn nearest_frames(frames: &[usize], ratio: f64) -> Vec<usize> {
    let mut nearest: Vec<usize> = Vec::with_capacity(frames.len());
    for &frame in frames {
        let next = nearest.last().map_or(0, |last| last + 1);
        nearest.push(((frame as f64 * ratio).round() as usize).max(next));
    }
    nearest
}

/// The clip with a frame every `frame_time` seconds and its frames `keyframes` as the new frames
/// `times`, whole: both ascend, and `times` from 0. Between two of them time runs as much slower or
/// faster as that takes.
pub fn spread(clip: Clip, keyframes: &[usize], times: &[usize], frame_time: f64) -> Clip {
    let mut poses: Vec<Pose> = Vec::new();
    for (from, new) in keyframes.windows(2).zip(times.windows(2)) {
        let ratio = (from[1] - from[0]) as f64 / (new[1] - new[0]) as f64;
        let places = (0..new[1] - new[0]).map(|frame| from[0] as f64 + frame as f64 * ratio);
        poses.extend(places.map(|place| between(&clip.poses, place)));
    }
    poses.extend(keyframes.last().map(|&last| clip.poses[last].clone()));
    Clip {
        frame_time,
        poses,
        ..clip
    }
}

/// The pose at a place counted in frames.
fn between(poses: &[Pose], place: f64) -> Pose {
    let before = place as usize;
    let share = place - before as f64;
    match poses.get(before + 1) {
        Some(after) if share > 1e-9 => poses[before].towards(after, share),
        _ => poses[before].clone(),
    }
}

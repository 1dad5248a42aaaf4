//! Clips danced faster or slower.

use super::clip::Clip;
use super::resample::{ResampleError, Resampled, at_step};

/// The same dance `tempo` times as fast, at the clip's own frame rate: 2.0 takes half as long.
/// Poses between frames as in [`resample`](super::resample()).
///
/// # Errors
/// As [`resample`](super::resample()) at the clip's frame rate divided by `tempo`.
pub fn at_tempo(clip: Clip, tempo: f64) -> Result<Clip, ResampleError> {
    let frame_time = clip.frame_time;
    let clip = at_step(clip, tempo, 1.0 / (frame_time * tempo))?;
    Ok(Clip { frame_time, ..clip })
}

/// The frames of [`at_tempo`] of a clip of `frames` frames, given its name and frame time (s).
///
/// # Errors
/// As [`at_tempo`].
pub fn frames_at_tempo(
    (name, frame_time): (&str, f64),
    frames: usize,
    tempo: f64,
) -> Result<Resampled, ResampleError> {
    let fps = 1.0 / (frame_time * tempo);
    Resampled::new((name, frame_time), frames, tempo, fps)
}

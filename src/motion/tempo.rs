//! Clips danced faster or slower.

use super::clip::Clip;
use super::resample::{ResampleError, resample};

/// The same dance `tempo` times as fast, at the clip's own frame rate: 2.0 takes half as long.
/// Poses between frames as in [`resample`].
///
/// # Errors
/// As [`resample`] at the clip's frame rate divided by `tempo`.
pub fn at_tempo(clip: Clip, tempo: f64) -> Result<Clip, ResampleError> {
    let frame_time = clip.frame_time;
    let clip = resample(clip, 1.0 / (frame_time * tempo))?;
    Ok(Clip { frame_time, ..clip })
}

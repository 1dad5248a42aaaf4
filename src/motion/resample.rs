//! Clips at another frame rate.

use thiserror::Error;

use super::clip::{Clip, Pose};

/// Files round their frame times (0.0333333, 0.00833333): a rate, or a ratio of rates, this close
/// to a whole number is that number.
const ROUNDING: f64 = 1e-4;
/// How many new frames one old frame may become.
const FINEST: f64 = 120.0;
/// Most frames (over two hours at 30 a second) that a clip may be refined to: a small file of few
/// frames a second would fill memory.
const MOST_FRAMES: usize = 250_000;

/// Why a clip cannot be resampled.
#[derive(Debug, Error, PartialEq)]
pub enum ResampleError {
    #[error("fps = {fps}: expected a positive number of frames a second")]
    Rate { fps: f64 },
    #[error(
        "{clip}: a frame time of {frame_time} s is too coarse for {fps} frames a second; \
         expected at most {} s",
        FINEST / fps
    )]
    TooCoarse {
        clip: String,
        frame_time: f64,
        fps: f64,
    },
    #[error(
        "{clip} would have {frames} frames at {fps} a second, more than {MOST_FRAMES}; cut it into parts"
    )]
    TooLong {
        clip: String,
        frames: usize,
        fps: f64,
    },
}

/// The clip at `fps` frames a second: rotations slerped, translations interpolated linearly, from
/// the first frame on up to the last.
///
/// A clip whose frame time rounds 1 / `fps` (0.0333333 s for 30 fps) is returned as it is; where
/// the old rate is whole, or old and new rate are whole multiples of each other, up to such
/// rounding, they are taken to be so exactly.
///
/// # Errors
/// `fps` is not a positive number, or a frame of the clip would become more than 120 or the clip
/// more than 250,000.
pub fn resample(clip: Clip, fps: f64) -> Result<Clip, ResampleError> {
    if !(fps.is_finite() && fps > 0.0) {
        return Err(ResampleError::Rate { fps });
    }
    let step = whole(whole(1.0 / clip.frame_time) / fps);
    at_step(clip, step, fps)
}

/// The clip at `fps` frames a second, `step` of its own frames from one to the next.
///
/// # Errors
/// As [`resample`].
pub(super) fn at_step(clip: Clip, step: f64, fps: f64) -> Result<Clip, ResampleError> {
    if step * FINEST < 1.0 {
        return Err(ResampleError::TooCoarse {
            clip: clip.name,
            frame_time: clip.frame_time,
            fps,
        });
    }
    if step == 1.0 || clip.poses.is_empty() {
        return Ok(clip);
    }
    let last = clip.poses.len() - 1;
    let frames = (last as f64 / step + 1e-9).floor() as usize + 1;
    if step < 1.0 && frames > MOST_FRAMES {
        return Err(ResampleError::TooLong {
            clip: clip.name,
            frames,
            fps,
        });
    }
    let poses = (0..frames)
        .map(|frame| pose_at(&clip.poses, frame as f64 * step))
        .collect();
    Ok(Clip {
        frame_time: 1.0 / fps,
        poses,
        ..clip
    })
}

/// A rate or a ratio of rates, without the rounding of frame times.
fn whole(ratio: f64) -> f64 {
    let snapped = if ratio >= 1.0 {
        ratio.round()
    } else {
        1.0 / (1.0 / ratio).round()
    };
    if (ratio / snapped - 1.0).abs() <= ROUNDING {
        snapped
    } else {
        ratio
    }
}

/// The pose at a time counted in frames; times beyond the last frame have its pose.
fn pose_at(poses: &[Pose], time: f64) -> Pose {
    let last = poses.len() - 1;
    let before = (time as usize).min(last);
    let after = (before + 1).min(last);
    let share = time - before as f64;
    let (from, to) = (&poses[before], &poses[after]);
    if share < 1e-9 || before == last {
        return from.clone();
    }
    from.towards(to, share)
}

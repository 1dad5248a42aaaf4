//! Clips at another frame rate.

use std::ops::Range;

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
    let frames = Resampled::new((&clip.name, clip.frame_time), clip.poses.len(), step, fps)?;
    if step == 1.0 {
        return Ok(clip);
    }
    Ok(Clip {
        frame_time: 1.0 / fps,
        poses: frames.poses(0..frames.len(), &clip.poses),
        ..clip
    })
}

/// The frames of a resampled clip, one range of them at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resampled {
    /// Old frames from one new frame to the next.
    step: f64,
    /// Old frames.
    old: usize,
    /// New frames.
    len: usize,
}

impl Resampled {
    /// Those of a clip of `old` frames, given its name and frame time.
    pub(super) fn new(
        (name, frame_time): (&str, f64),
        old: usize,
        step: f64,
        fps: f64,
    ) -> Result<Self, ResampleError> {
        if step * FINEST < 1.0 {
            return Err(ResampleError::TooCoarse {
                clip: name.into(),
                frame_time,
                fps,
            });
        }
        let Some(last) = old.checked_sub(1).filter(|_| step != 1.0) else {
            return Ok(Self {
                step,
                old,
                len: old,
            });
        };
        let len = (last as f64 / step + 1e-9).floor() as usize + 1;
        if step < 1.0 && len > MOST_FRAMES {
            return Err(ResampleError::TooLong {
                clip: name.into(),
                frames: len,
                fps,
            });
        }
        Ok(Self { step, old, len })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The old frames that new ones lie between; `frames` are not beyond the last.
    pub fn between(&self, frames: Range<usize>) -> Range<usize> {
        let old = |frame: usize| ((frame as f64 * self.step) as usize).min(self.old - 1);
        match frames.is_empty() {
            true => 0..0,
            false => old(frames.start)..(old(frames.end - 1) + 2).min(self.old),
        }
    }

    /// The new frames; `old` are the poses that they lie [between](Resampled::between).
    pub fn poses(&self, frames: Range<usize>, old: &[Pose]) -> Vec<Pose> {
        let first = self.between(frames.clone()).start;
        let pose = |frame| self.pose_at(old, first, frame as f64 * self.step);
        frames.map(pose).collect()
    }

    /// The pose at a time counted in old frames, `poses` beginning with the frame `first`; times
    /// beyond the last frame have its pose.
    fn pose_at(&self, poses: &[Pose], first: usize, time: f64) -> Pose {
        let last = self.old - 1;
        let before = (time as usize).min(last);
        let share = time - before as f64;
        let from = &poses[before - first];
        if share < 1e-9 || before == last {
            return from.clone();
        }
        from.towards(&poses[before + 1 - first], share)
    }
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

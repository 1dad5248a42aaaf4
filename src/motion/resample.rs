//! Clips at another frame rate.

use thiserror::Error;

use super::clip::{Clip, Pose};

/// Files round their frame times (0.0333333, 0.00833333): a ratio of rates this close to a whole
/// number is that number.
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
/// old and new rate are whole multiples of each other up to such rounding, they are taken to be so
/// exactly.
///
/// # Errors
/// `fps` is not a positive number, or a frame of the clip would become more than 120 or the clip
/// more than 250,000.
pub fn resample(clip: Clip, fps: f64) -> Result<Clip, ResampleError> {
    if !(fps.is_finite() && fps > 0.0) {
        return Err(ResampleError::Rate { fps });
    }
    let step = whole(1.0 / (fps * clip.frame_time));
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

/// A ratio of rates, without the rounding of frame times.
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
    Pose {
        translations: from
            .translations
            .iter()
            .zip(&to.translations)
            .map(|(a, b)| a.lerp(*b, share))
            .collect(),
        rotations: from
            .rotations
            .iter()
            .zip(&to.rotations)
            .map(|(a, b)| a.slerp(*b, share).normalize())
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::motion::{Joint, Skeleton};

    /// One joint that moves and turns evenly: 1 cm and 0.1 rad a frame.
    fn even(frames: usize, frame_time: f64) -> Clip {
        let joint = Joint {
            name: "Hips".into(),
            parent: None,
            offset: DVec3::ZERO,
            end_sites: Vec::new(),
        };
        let pose = |frame: usize| Pose {
            translations: vec![DVec3::X * frame as f64],
            rotations: vec![DQuat::from_rotation_y(0.1 * frame as f64)],
        };
        let skeleton = Skeleton {
            joints: vec![joint],
        };
        Clip {
            name: "even".into(),
            skeleton,
            frame_time,
            poses: (0..frames).map(pose).collect(),
        }
    }

    #[test]
    fn a_rounded_frame_time_counts_as_its_rate() {
        assert_eq!(resample(even(5, 0.0333333), 30.0), Ok(even(5, 0.0333333)));
        let quarter = resample(even(2750, 0.00833333), 30.0).unwrap();
        assert_eq!(quarter.poses.len(), 688);
        assert_eq!(quarter.frame_time, 1.0 / 30.0);
        assert_eq!(quarter.poses[687], even(2749, 0.1).poses[2748]);
    }

    #[test]
    fn any_ratio_keeps_an_even_motion_even() {
        for (frame_time, step, frames) in [
            (1.0 / 24.0, 0.8, 12),
            (1.0 / 50.0, 50.0 / 30.0, 6),
            (0.1, 1.0 / 3.0, 28),
        ] {
            let new = resample(even(10, frame_time), 30.0).unwrap();
            assert_eq!(new.poses.len(), frames, "{frame_time}");
            for (frame, pose) in new.poses.iter().enumerate() {
                let time = frame as f64 * step;
                assert!((pose.translations[0].x - time).abs() < 1e-9);
                assert!(pose.rotations[0].angle_between(DQuat::from_rotation_y(0.1 * time)) < 1e-6);
            }
        }
    }

    #[test]
    fn a_rate_that_would_blow_up_a_clip_is_refused() {
        assert!(matches!(
            resample(even(5, 3600.0), 30.0),
            Err(ResampleError::TooCoarse { .. })
        ));
        assert!(matches!(
            resample(even(3000, 3.9), 30.0),
            Err(ResampleError::TooLong {
                frames: 350_884,
                ..
            })
        ));
        assert!(matches!(
            resample(even(5, 0.1), f64::NAN),
            Err(ResampleError::Rate { .. })
        ));
    }
}

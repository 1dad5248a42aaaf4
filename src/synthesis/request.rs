//! What a sequence is made from: keyframes in time, the root trajectory, the velocity factors.

use std::ops::Range;

use glam::DVec3;
use ndarray::{Array2, s};

use super::SynthesisError;
use super::controls::{rows_of, timed_curve};
use super::retarget::{bones_of, retarget, with_constant_bones};
use crate::models::generator::{Given, Request};
use crate::models::transition::DanceClip;
use crate::models::transition::KeyframePose;
use crate::models::transition::window::wrap;
use crate::motion::features::{BODY_VELOCITIES, FACING, ROOT_POSITION, VELOCITY_FACTORS};
use crate::motion::{Feet, Floor, PARTS, Skeleton};

/// A keyframe and where it stands in the result.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedKeyframe {
    /// Frame of the result.
    pub time: usize,
    pub keyframe: KeyframePose,
}

/// Where a keyframe comes from and where it goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyframeSource<'a> {
    pub clip: &'a DanceClip,
    /// Frame of the clip at its rate.
    pub frame: usize,
    /// Frame of the result.
    pub time: usize,
}

/// Keyframes k_0 .. k_K with K transitions between them, and the controls of all frames from the
/// first to the last.
///
/// F = time of the last keyframe + 1 is the number of frames of the result. The controls of
/// [`super::controls`] change one request into another.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceRequest {
    /// The dance skeleton with constant bones: every keyframe's translations but the root's are
    /// these offsets.
    pub skeleton: Skeleton,
    /// Seconds from one frame to the next.
    pub frame_time: f64,
    /// By ascending time, the first at 0.
    pub keyframes: Vec<TimedKeyframe>,
    /// Root positions wanted, `[F, 3]`, cm. A keyframe's root lies on it.
    pub root_trajectory: Array2<f64>,
    /// Velocity factors wanted, `[F, 5]`, cm/frame.
    pub velocity_factors: Array2<f64>,
    /// Where the keyframes stand; none on a skeleton without feet. Where they are those of a clip,
    /// as low as its feet come between them, else as low as the feet usually are in their clips.
    pub floor: Option<Floor>,
}

impl SequenceRequest {
    /// Keyframes from one or several clips. The first one's dancer dances: keyframes of others are
    /// put onto the same bones by their joints' rotations, the height of the root scaled by the
    /// length of the legs.
    ///
    /// The root goes along a smooth curve through the keyframes' roots, and the velocity factors
    /// evenly from each keyframe's to the next one's. Between two keyframes of one clip in its
    /// order the dancer turns as often as there; else the shorter way.
    ///
    /// # Errors
    /// Fewer than two keyframes, times that do not ascend from 0, frames that a clip does not have,
    /// dancers whose rotations mean different things.
    pub fn from_keyframes(sources: &[KeyframeSource<'_>]) -> Result<Self, SynthesisError> {
        let times: Vec<usize> = sources.iter().map(|source| source.time).collect();
        check_times(&times)?;
        let poses: Vec<KeyframePose> = sources
            .iter()
            .map(|source| keyframe_of(source.clip, source.frame))
            .collect::<Result<_, _>>()?;
        let dancer = &sources[0].clip.clip;
        let skeleton = bones_of(&dancer.skeleton, &poses[0].pose);
        let mut keyframes: Vec<TimedKeyframe> = Vec::with_capacity(sources.len());
        let mut shift = wrap(poses[0].features[FACING.start]) - poses[0].features[FACING.start];
        for (index, (source, mut keyframe)) in sources.iter().zip(poses).enumerate() {
            if let Some(before) = keyframes.last() {
                let from = &sources[index - 1];
                if !(std::ptr::eq(from.clip, source.clip) && from.frame < source.frame) {
                    let facing = before.keyframe.features[FACING.start];
                    let own = keyframe.features[FACING.start];
                    shift = facing + wrap(own - facing) - own;
                }
            }
            keyframe.features[FACING.start] += shift;
            let keyframe = if source.clip.clip.skeleton == dancer.skeleton {
                with_constant_bones(keyframe, &skeleton)?
            } else {
                let bones = bones_of(&source.clip.clip.skeleton, &keyframe.pose);
                retarget(keyframe, &bones, &skeleton, &source.clip.name)?
            };
            let time = source.time;
            keyframes.push(TimedKeyframe { time, keyframe });
        }
        let frames = times[times.len() - 1] + 1;
        let floors = sources.iter().enumerate().filter_map(|(index, source)| {
            let is_seen = |seen: &KeyframeSource| std::ptr::eq(seen.clip, source.clip);
            let is_first = !sources[..index].iter().any(is_seen);
            is_first.then(|| floor_of(source.clip, 0..source.clip.frames(), Floor::usual))?
        });
        let mut request = Self {
            skeleton,
            frame_time: dancer.frame_time,
            keyframes,
            root_trajectory: Array2::zeros((frames, 3)),
            velocity_factors: Array2::zeros((frames, PARTS)),
            floor: floors.reduce(Floor::or_lower),
        };
        request.root_trajectory = rows_of(&timed_curve(&times, &request.keyframe_roots()));
        request.velocity_factors = request.velocity_between_keyframes();
        Ok(request)
    }

    /// Frames `frames` (ascending, at the clip's rate) of a recorded clip as keyframes, its root
    /// trajectory and velocity factors as controls; frame `frames[0]` becomes frame 0 of the
    /// result. Nothing else of the recorded motion goes in.
    ///
    /// # Errors
    /// As [`SequenceRequest::from_keyframes`].
    pub fn from_clip(clip: &DanceClip, frames: &[usize]) -> Result<Self, SynthesisError> {
        let first = frames.first().copied().unwrap_or(0);
        if let Some(pair) = frames.windows(2).find(|pair| pair[1] <= pair[0]) {
            let (before, time) = (pair[0], pair[1]);
            return Err(SynthesisError::Order { before, time });
        }
        let sources: Vec<KeyframeSource> = frames
            .iter()
            .map(|&frame| KeyframeSource {
                clip,
                frame,
                time: frame - first,
            })
            .collect();
        Self::from_keyframes(&sources)?.like(clip, first)
    }

    /// The same with root trajectory, velocity factors and floor of a clip, from its frame `first`
    /// on. Keyframes are not moved.
    ///
    /// # Errors
    /// The clip ends before the last keyframe.
    pub fn like(mut self, clip: &DanceClip, first: usize) -> Result<Self, SynthesisError> {
        let end = first + self.frames();
        if end > clip.frames() {
            return Err(no_frame(clip, end - 1));
        }
        let rows = clip.features.slice(s![first..end, ..]);
        self.root_trajectory = rows.slice(s![.., ROOT_POSITION]).to_owned();
        self.velocity_factors = rows.slice(s![.., VELOCITY_FACTORS]).to_owned();
        self.floor = floor_of(clip, first..end, Floor::under);
        Ok(self)
    }

    /// F, the number of frames of the result.
    pub fn frames(&self) -> usize {
        self.keyframes.last().map_or(0, |last| last.time + 1)
    }

    /// Frames of the keyframes in the result.
    pub fn times(&self) -> Vec<usize> {
        self.keyframes
            .iter()
            .map(|keyframe| keyframe.time)
            .collect()
    }

    /// Checks that the parts fit together; what concerns single transitions is checked by the model
    /// that is asked.
    ///
    /// # Errors
    /// Fewer than two keyframes, times that do not ascend from 0, controls of another shape than
    /// `[F, 3]` and `[F, 5]`.
    pub fn check(&self) -> Result<(), SynthesisError> {
        let times = self.times();
        check_times(&times)?;
        let frames = self.frames();
        check_shape("the root trajectory", &self.root_trajectory, (frames, 3))?;
        check_shape(
            "the array of velocity factors",
            &self.velocity_factors,
            (frames, PARTS),
        )
    }

    /// The request for the frames from the first of these keyframes to the last, under the controls
    /// of the same frames.
    ///
    /// # Panics
    /// Without keyframes.
    pub(crate) fn piece(&self, keyframes: &[TimedKeyframe]) -> Request {
        let (from, to) = (keyframes[0].time, keyframes[keyframes.len() - 1].time);
        let rows = |of: &Array2<f64>| Some(of.slice(s![from..=to, ..]).to_owned());
        let given = keyframes
            .iter()
            .map(|TimedKeyframe { time, keyframe }| Given {
                frame: (time - from) as i64,
                pose: keyframe.pose.clone(),
                features: Some(keyframe.features.clone()),
            });
        Request {
            skeleton: self.skeleton.clone(),
            frame_time: self.frame_time,
            frames: to - from + 1,
            given: given.collect(),
            root: rows(&self.root_trajectory),
            velocity_factors: rows(&self.velocity_factors),
            contacts: None,
            music: None,
            seed: 0,
        }
    }
}

/// Times of keyframes: two or more, ascending from 0.
pub(super) fn check_times(times: &[usize]) -> Result<(), SynthesisError> {
    if times.len() < 2 {
        return Err(SynthesisError::TooFewKeyframes { found: times.len() });
    }
    if times[0] != 0 {
        return Err(SynthesisError::FirstKeyframe { time: times[0] });
    }
    for pair in times.windows(2) {
        if pair[1] <= pair[0] {
            let (before, time) = (pair[0], pair[1]);
            return Err(SynthesisError::Order { before, time });
        }
    }
    Ok(())
}

/// A control has the shape `(rows, columns)`.
pub(super) fn check_shape(
    what: &'static str,
    control: &Array2<f64>,
    expected: (usize, usize),
) -> Result<(), SynthesisError> {
    let found = control.dim();
    if found == expected {
        Ok(())
    } else {
        Err(SynthesisError::Shape {
            what,
            found,
            expected,
        })
    }
}

/// A frame of a clip as a keyframe: its features and its pose.
///
/// Frame 0 of a clip has no velocity; it takes that of frame 1, and the velocity factors that go
/// with it.
///
/// # Errors
/// [`SynthesisError::NoFrame`].
pub fn keyframe_of(clip: &DanceClip, frame: usize) -> Result<KeyframePose, SynthesisError> {
    let Some(pose) = clip.clip.poses.get(frame).filter(|_| frame < clip.frames()) else {
        return Err(no_frame(clip, frame));
    };
    let mut features = clip.features.row(frame).to_owned();
    if frame == 0 && clip.frames() > 1 {
        let moving = BODY_VELOCITIES.start..VELOCITY_FACTORS.end;
        features
            .slice_mut(s![moving.clone()])
            .assign(&clip.features.slice(s![1, moving]));
    }
    Ok(KeyframePose {
        features,
        pose: pose.clone(),
    })
}

/// The floor of some frames of a clip.
fn floor_of(
    clip: &DanceClip,
    frames: Range<usize>,
    measure: fn(&[Vec<DVec3>], &Feet) -> Floor,
) -> Option<Floor> {
    let DanceClip { clip, .. } = clip;
    let feet = Feet::of(&clip.skeleton).ok()?;
    let world = clip.skeleton.world_positions(clip.poses.get(frames)?);
    Some(measure(&world, &feet))
}

fn no_frame(clip: &DanceClip, frame: usize) -> SynthesisError {
    SynthesisError::NoFrame {
        clip: clip.name.clone(),
        frame,
        last: clip.frames().saturating_sub(1),
        fps: 1.0 / clip.clip.frame_time,
    }
}

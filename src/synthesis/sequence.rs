//! From a request to motion: one transition after another.

use std::f64::consts::TAU;

use glam::DVec3;
use ndarray::{Array2, s};

use super::blend::{Start, Track, blend};
use super::foot_cleanup::pin_feet;
use super::{SequenceRequest, SynthesisError};
use crate::models::transition::{KeyframePose, TransitionModel};
use crate::motion::contact::{foot_skate, in_contact};
use crate::motion::features::{
    CONTACTS, FACING, FRAME, VELOCITY_FACTORS, write_positions, write_velocities,
};
use crate::motion::fit::fit_rotations;
use crate::motion::placement::{vector, world_positions};
use crate::motion::{Clip, JOINTS, Pose};

/// What is done to the predicted motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SynthesisOptions {
    /// Pin feet where contact is predicted.
    pub foot_cleanup: bool,
}

/// How far a model's last frame is from the keyframe that it was to meet, before it is bent onto it: distances of the joints' world
/// positions, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyframeMiss {
    /// Frame of the result.
    pub time: usize,
    pub mean: f64,
    pub max: f64,
}

/// Distances from predicted positions to those of the fitted rotations, over all predicted frames and joints, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitError {
    pub mean: f64,
    pub max: f64,
}

/// A generated sequence of F frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Sequence {
    /// The motion, F poses on the request's skeleton; at the keyframes, the keyframes.
    pub clip: Clip,
    /// Frames of the keyframes.
    pub keyframes: Vec<usize>,
    /// Features of `clip`, `[F, 149]`: o^r is the predicted angle, bent onto the keyframes; p^b (turned by it), p^r, v^b and v^r are measured on
    /// the poses; c is as predicted (0 to 1, clamped).
    pub features: Array2<f64>,
    /// What the model predicted, before anything was done to it, `[F, 149]`; row 0 is the first keyframe.
    pub predicted: Array2<f64>,
    /// Whether contact is predicted, `[F]` of LeftFoot, LeftToeBase, RightFoot, RightToeBase.
    pub contacts: Vec<[bool; 4]>,
    /// One for each keyframe but the first.
    pub misses: Vec<KeyframeMiss>,
    pub fit: FitError,
    pub foot_skate: FootSkate,
}

/// Mean distance that a foot joint moves a frame in the world while contact is predicted, cm/frame; none where no contact is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FootSkate {
    /// Before the feet are pinned.
    pub before: Option<f64>,
    /// Of the clip; the same where no foot was pinned.
    pub after: Option<f64>,
}

impl Sequence {
    /// World positions of the joints of `clip`, `[F][24]`, cm.
    pub fn world_positions(&self) -> Vec<Vec<DVec3>> {
        self.clip
            .poses
            .iter()
            .map(|pose| pose.world_positions(&self.clip.skeleton))
            .collect()
    }
}

/// How far the root of a sequence is from the trajectory that was asked for, mean and maximum over its frames, cm.
pub fn trajectory_error(request: &SequenceRequest, sequence: &Sequence) -> (f64, f64) {
    let asked = request.root_trajectory.rows().into_iter();
    let distances: Vec<f64> = asked
        .zip(&sequence.clip.poses)
        .map(|(row, pose)| pose.translations[0].distance(vector(row)))
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    (mean, distances.iter().copied().fold(0.0, f64::max))
}

/// Generates the transitions of a request one after another, each from what was generated before it, and makes them one clip `name`.
///
/// Each transition starts from the last frame of the one before after that was bent onto its keyframe; the features it starts from are
/// measured on the bent motion.
///
/// # Errors
/// The request does not fit together, the model fails, or predicts what no skeleton can take.
pub fn synthesise(
    model: &dyn TransitionModel,
    request: &SequenceRequest,
    options: &SynthesisOptions,
    name: &str,
) -> Result<Sequence, SynthesisError> {
    request.check()?;
    let mut motion = Motion::new(request);
    let mut misses = Vec::new();
    let mut fits = Vec::new();
    for index in 1..request.keyframes.len() {
        let (from, to) = (
            request.keyframes[index - 1].time,
            request.keyframes[index].time,
        );
        let mut asked = request.transition(index, motion.last());
        // A model that has made a turn too many or too few is not asked for it back: the target counts its turns from there.
        let before = &request.keyframes[index - 1].keyframe;
        let turned = asked.start.features[FACING.start] - before.features[FACING.start];
        asked.target.features[FACING.start] += (turned / TAU).round() * TAU;
        let failed = |source| SynthesisError::Transition {
            from,
            to,
            source: Box::new(source),
        };
        let mut transitions = model
            .transitions(std::slice::from_ref(&asked))
            .map_err(failed)?;
        let Some(transition) = transitions.pop() else {
            let model = model.name().into();
            return Err(SynthesisError::NoTransition { model });
        };
        transition.check(to - from).map_err(failed)?;
        let frames = transition.frames;
        let positions: Vec<_> = frames.rows().into_iter().map(world_positions).collect();
        let fit = fit_rotations(
            &request.skeleton,
            &positions,
            &asked.start.pose,
            Some(&asked.target.pose),
        )
        .map_err(|source| SynthesisError::Rotations {
            from,
            to,
            source: Box::new(source),
        })?;
        fits.push((positions.len(), fit.mean_error, fit.max_error));
        misses.push(miss(
            to,
            &positions[positions.len() - 1],
            request,
            &asked.target,
        ));
        let mut track = Track {
            poses: fit.poses,
            facing: frames.column(FACING.start).to_vec(),
        };
        let facing = asked.target.features[FACING.start];
        blend(&mut track, &motion.start(), &asked.target.pose, facing);
        motion.append(track, &frames);
    }
    Ok(motion.finish(misses, &fits, options, name))
}

/// Distances of a predicted frame from the keyframe.
fn miss(
    time: usize,
    predicted: &[DVec3; JOINTS],
    request: &SequenceRequest,
    target: &KeyframePose,
) -> KeyframeMiss {
    let wanted = target.pose.world_positions(&request.skeleton);
    let distances = predicted.iter().zip(wanted).map(|(a, b)| a.distance(b));
    KeyframeMiss {
        time,
        mean: distances.clone().sum::<f64>() / JOINTS as f64,
        max: distances.fold(0.0, f64::max),
    }
}

/// The motion as far as it has been generated.
struct Motion<'r> {
    request: &'r SequenceRequest,
    poses: Vec<Pose>,
    facing: Vec<f64>,
    /// `[F, 149]`, as in [`Sequence::predicted`]; zeros in the frames to come.
    predicted: Array2<f64>,
}

impl<'r> Motion<'r> {
    fn new(request: &'r SequenceRequest) -> Self {
        let first = &request.keyframes[0].keyframe;
        let mut predicted = Array2::zeros((request.frames(), FRAME));
        predicted
            .row_mut(0)
            .assign(&first.features.slice(s![..FRAME]));
        Self {
            request,
            poses: vec![first.pose.clone()],
            facing: vec![first.features[FACING.start]],
            predicted,
        }
    }

    /// The last frame as the keyframe that the next transition starts from.
    fn last(&self) -> KeyframePose {
        let first = &self.request.keyframes[0].keyframe;
        let frames = self.poses.len();
        let mut keyframe = first.clone();
        if frames > 1 {
            let rows = self.features(frames - 2..frames);
            let mut numbers = keyframe.features.slice_mut(s![..FRAME]);
            numbers.assign(&rows.row(1));
            let wanted = self.request.velocity_factors.row(frames - 1);
            keyframe
                .features
                .slice_mut(s![VELOCITY_FACTORS])
                .assign(&wanted);
            keyframe.pose.clone_from(&self.poses[frames - 1]);
        }
        keyframe
    }

    /// The last frame as what the next transition is bent onto.
    fn start(&self) -> Start<'_> {
        let last = self.poses.len() - 1;
        let at = |frame: usize| (&self.poses[frame], self.facing[frame]);
        let (pose, facing) = at(last);
        Start {
            pose,
            facing,
            before: last.checked_sub(1).map(at),
        }
    }

    /// The frames of a transition, with what was predicted for them.
    fn append(&mut self, track: Track, frames: &Array2<f64>) {
        let from = self.poses.len();
        let mut rows = self
            .predicted
            .slice_mut(s![from..from + frames.nrows(), ..]);
        rows.assign(frames);
        self.poses.extend(track.poses);
        self.facing.extend(track.facing);
    }

    /// Features of some frames, measured on the poses; the first of them takes its velocity from the first keyframe.
    fn features(&self, range: std::ops::Range<usize>) -> Array2<f64> {
        let mut rows = self.predicted.slice(s![range.clone(), ..]).to_owned();
        for (mut row, frame) in rows.rows_mut().into_iter().zip(range) {
            let positions = self.poses[frame].world_positions(&self.request.skeleton);
            write_positions(&mut row, &positions, self.facing[frame]);
            row.slice_mut(s![CONTACTS])
                .mapv_inplace(|label| label.clamp(0.0, 1.0));
        }
        write_velocities(&mut rows);
        rows
    }

    fn finish(
        mut self,
        misses: Vec<KeyframeMiss>,
        fits: &[(usize, f64, f64)],
        options: &SynthesisOptions,
        name: &str,
    ) -> Sequence {
        let contacts: Vec<[bool; 4]> = self.predicted.rows().into_iter().map(in_contact).collect();
        let skeleton = &self.request.skeleton;
        let skate = |poses: &[Pose]| {
            let world: Vec<_> = poses
                .iter()
                .map(|pose| pose.world_positions(skeleton))
                .collect();
            foot_skate(&world, &contacts)
        };
        let keyframes = self.request.times();
        let before = skate(&self.poses);
        if options.foot_cleanup {
            pin_feet(skeleton, &mut self.poses, &contacts, &keyframes);
        }
        let after = skate(&self.poses);
        let frames: usize = fits.iter().map(|(frames, ..)| frames).sum();
        let sum: f64 = fits
            .iter()
            .map(|&(frames, mean, _)| frames as f64 * mean)
            .sum();
        Sequence {
            features: self.features(0..self.poses.len()),
            keyframes,
            contacts,
            misses,
            fit: FitError {
                mean: sum / frames as f64,
                max: fits.iter().fold(0.0, |max, &(.., worst)| max.max(worst)),
            },
            foot_skate: FootSkate { before, after },
            clip: Clip {
                name: name.into(),
                skeleton: skeleton.clone(),
                frame_time: self.request.frame_time,
                poses: self.poses,
            },
            predicted: self.predicted,
        }
    }
}

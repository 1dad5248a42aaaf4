//! From a request to motion: one transition after another.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;
use ndarray::{Array2, s};

use super::blend::{Start, Track, blend};
use super::foot_cleanup::pin_feet;
use super::{SequenceRequest, SynthesisError};
use crate::models::generator::NeededPoses;
use crate::models::transition::KeyframePose;
use crate::models::{Generator, Motion};
use crate::motion::contact::{CONTACT_LABEL, FOOT_JOINTS, FootTravel};
use crate::motion::facing::{FacingJoints, facing_angles};
use crate::motion::features::{
    CONTACTS, FACING, FRAME, VELOCITY_FACTORS, write_positions, write_velocities,
};
use crate::motion::fit::fit_rotations;
use crate::motion::placement::vector;
use crate::motion::{Clip, FeatureConfig, Feet, Floor, Pose};

/// What is done to the predicted motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SynthesisOptions {
    /// Pin feet where they stand on the floor, and lift them where they are below it.
    pub foot_cleanup: bool,
}

/// How far a model's last frame is from the keyframe that it was to meet, before it is bent onto
/// it: distances of the joints' world positions, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeyframeMiss {
    /// Frame of the result.
    pub time: usize,
    pub mean: f64,
    pub max: f64,
}

/// Distances from predicted positions to those of the fitted rotations, over all predicted frames
/// and joints, cm.
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
    /// Features of `clip`, `[F, 149]`: o^r is the predicted angle, bent onto the keyframes; p^b
    /// (turned by it), p^r, v^b and v^r are measured on the poses; c is as predicted (0 to 1,
    /// clamped).
    pub features: Array2<f64>,
    /// Whether contact is predicted, `[F]` of LeftFoot, LeftToeBase, RightFoot, RightToeBase.
    pub contacts: Vec<[bool; 4]>,
    /// One for each keyframe but the first.
    pub misses: Vec<KeyframeMiss>,
    pub fit: FitError,
    /// None on a skeleton without feet.
    pub feet: Option<FeetOnFloor>,
    /// What the feet were pinned to; none where they were not.
    pub pinned_to: Option<(Feet, Floor)>,
}

/// How well feet keep to the floor: that of the request or, where a keyframe's feet are lower, the
/// keyframe's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeetOnFloor {
    /// Before the feet are pinned.
    pub before: ToesOnFloor,
    /// Of the clip; the same where no foot was pinned.
    pub after: ToesOnFloor,
}

/// How well toes keep to the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToesOnFloor {
    /// Foot skate, see [`Floor::toe_travel`].
    pub travel: FootTravel,
    /// See [`Floor::lowest_toe`], cm.
    pub lowest: f64,
}

/// How far the root of a sequence is from the trajectory that was asked for, mean and maximum over
/// its frames, cm.
pub fn trajectory_error(request: &SequenceRequest, sequence: &Sequence) -> (f64, f64) {
    let asked = request.root_trajectory.rows().into_iter();
    let distances: Vec<f64> = asked
        .zip(&sequence.clip.poses)
        .map(|(row, pose)| pose.translations[0].distance(vector(row)))
        .collect();
    let mean = distances.iter().sum::<f64>() / distances.len() as f64;
    (mean, distances.iter().copied().fold(0.0, f64::max))
}

/// Generates the motion of a request and makes it one clip `name`.
///
/// A model that fills the frames between two poses is asked for one transition after another, each
/// from the last frame of the one before after that was bent onto its keyframe: the features it
/// starts from are measured on the bent motion. Any other model is asked once, for all frames.
/// Joint rotations are the model's own where it makes them, else fitted to its positions.
///
/// # Errors
/// The request does not fit together, the model fails, or predicts what no skeleton can take.
pub fn synthesise(
    model: &dyn Generator,
    request: &SequenceRequest,
    options: &SynthesisOptions,
    name: &str,
) -> Result<Sequence, SynthesisError> {
    request.check()?;
    let mut motion = Made::new(request);
    let last = request.keyframes.len() - 1;
    let mut index = 0;
    while index < last {
        let end = match model.needs().poses {
            NeededPoses::Ends => index + 1,
            _ => last,
        };
        motion.make(model, index, end)?;
        index = end;
    }
    Ok(motion.finish(options, name))
}

/// World positions of a motion's joints, `[F][joints]`, cm.
fn world_of(motion: &Motion) -> Vec<Vec<DVec3>> {
    let frames = motion.positions.outer_iter();
    frames
        .map(|frame| frame.rows().into_iter().map(vector).collect())
        .collect()
}

/// Distances of a predicted frame from the keyframe.
fn miss(
    time: usize,
    predicted: &[DVec3],
    request: &SequenceRequest,
    target: &KeyframePose,
) -> KeyframeMiss {
    let wanted = target.pose.world_positions(&request.skeleton);
    let distances = predicted.iter().zip(wanted).map(|(a, b)| a.distance(b));
    KeyframeMiss {
        time,
        mean: distances.clone().sum::<f64>() / predicted.len() as f64,
        max: distances.fold(0.0, f64::max),
    }
}

/// The motion as far as it has been generated.
struct Made<'r> {
    request: &'r SequenceRequest,
    poses: Vec<Pose>,
    facing: Vec<f64>,
    /// As predicted, `[F, 4]`; those of the frames to come are 0.
    contacts: Array2<f64>,
    misses: Vec<KeyframeMiss>,
    /// Of each piece: number of frames, mean and largest error of the fitted rotations.
    fits: Vec<(usize, f64, f64)>,
}

impl<'r> Made<'r> {
    fn new(request: &'r SequenceRequest) -> Self {
        let first = &request.keyframes[0].keyframe;
        let mut contacts = Array2::zeros((request.frames(), FOOT_JOINTS.len()));
        contacts
            .row_mut(0)
            .assign(&first.features.slice(s![CONTACTS]));
        Self {
            request,
            poses: vec![first.pose.clone()],
            facing: vec![first.features[FACING.start]],
            contacts,
            misses: Vec::new(),
            fits: Vec::new(),
        }
    }

    /// Makes the frames from keyframe `index`, which the motion has come to, to keyframe `end`.
    fn make(
        &mut self,
        model: &dyn Generator,
        index: usize,
        end: usize,
    ) -> Result<(), SynthesisError> {
        let request = self.request;
        let mut keyframes = request.keyframes[index..=end].to_vec();
        let (from, to) = (keyframes[0].time, keyframes[end - index].time);
        let start = self.last();
        // A model that has made a turn too many or too few is not asked for it back: the targets
        // count their turns from there.
        let facing = FACING.start;
        let turned = start.features[facing] - keyframes[0].keyframe.features[facing];
        keyframes[0].keyframe = start;
        for target in &mut keyframes[1..] {
            target.keyframe.features[facing] += (turned / TAU).round() * TAU;
        }
        let failed = |source| SynthesisError::Transition {
            from,
            to,
            source: Box::new(source),
        };
        let asked = request.piece(&keyframes);
        let mut motions = model
            .generate(std::slice::from_ref(&asked))
            .map_err(failed)?;
        let Some(motion) = motions.pop() else {
            let model = model.name().into();
            return Err(SynthesisError::NoTransition { model });
        };
        motion.check(&asked).map_err(failed)?;
        let positions = world_of(&motion);
        let poses = match motion.poses {
            Some(poses) => poses[1..].to_vec(),
            None => {
                let fit = fit_rotations(
                    &request.skeleton,
                    &positions[1..],
                    &keyframes[0].keyframe.pose,
                    keyframes.last().map(|last| &last.keyframe.pose),
                )
                .map_err(|source| SynthesisError::Rotations {
                    from,
                    to,
                    source: Box::new(source),
                })?;
                self.fits.push((to - from, fit.mean_error, fit.max_error));
                fit.poses
            }
        };
        let facing = match motion.facing {
            Some(facing) => facing.to_vec(),
            None => {
                let sigma = FeatureConfig::default().facing_sigma;
                facing_angles(&positions, &FacingJoints::DANCE, sigma)
            }
        };
        if let Some(contacts) = motion.contacts {
            let rows = contacts.slice(s![1.., ..]);
            self.contacts.slice_mut(s![from + 1..=to, ..]).assign(&rows);
        }
        for pair in keyframes.windows(2) {
            let (first, last) = (pair[0].time - from, pair[1].time - from);
            let target = &pair[1].keyframe;
            self.misses
                .push(miss(pair[1].time, &positions[last], request, target));
            let mut track = Track {
                poses: poses[first..last].to_vec(),
                facing: facing[first + 1..=last].to_vec(),
            };
            let wanted = target.features[FACING.start];
            blend(&mut track, &self.start(), &target.pose, wanted);
            self.poses.extend(track.poses);
            self.facing.extend(track.facing);
        }
        Ok(())
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

    /// Features of some frames, measured on the poses; the first of them keeps the velocity of the
    /// first keyframe.
    fn features(&self, range: Range<usize>) -> Array2<f64> {
        let first = &self.request.keyframes[0].keyframe.features;
        let mut rows = Array2::zeros((range.len(), FRAME));
        rows.row_mut(0).assign(&first.slice(s![..FRAME]));
        for (mut row, frame) in rows.rows_mut().into_iter().zip(range) {
            let positions = self.poses[frame].world_positions(&self.request.skeleton);
            write_positions(&mut row, &positions, self.facing[frame]);
            let labels = self.contacts.row(frame).mapv(|label| label.clamp(0.0, 1.0));
            row.slice_mut(s![CONTACTS]).assign(&labels);
        }
        write_velocities(&mut rows);
        rows
    }

    /// The feet, and the floor under request and keyframes.
    fn floor(&self) -> Option<(Feet, Floor)> {
        let request = self.request;
        let feet = Feet::of(&request.skeleton).ok()?;
        let keyframes = request.keyframes.iter();
        let world = keyframes.map(|it| it.keyframe.pose.world_positions(&request.skeleton));
        let under = Floor::under(&world.collect::<Vec<_>>(), &feet);
        Some((feet, request.floor?.or_lower(under)))
    }

    fn finish(mut self, options: &SynthesisOptions, name: &str) -> Sequence {
        let labels = self.contacts.rows().into_iter();
        let contacts: Vec<[bool; 4]> = labels
            .map(|row| std::array::from_fn(|foot| row[foot] > CONTACT_LABEL))
            .collect();
        let fits = &self.fits;
        let skeleton = &self.request.skeleton;
        let keyframes = self.request.times();
        let floor = self.floor();
        let feet = floor.map(|(feet, floor)| {
            let toes = |poses: &[Pose]| {
                let world = skeleton.world_positions(poses);
                ToesOnFloor {
                    travel: floor.toe_travel(&world, &feet),
                    lowest: floor.lowest_toe(&world, &feet),
                }
            };
            let before = toes(&self.poses);
            if options.foot_cleanup {
                pin_feet(skeleton, &mut self.poses, &feet, &floor, &keyframes);
            }
            let after = toes(&self.poses);
            FeetOnFloor { before, after }
        });
        let frames: usize = fits.iter().map(|(frames, ..)| frames).sum();
        let sum: f64 = fits
            .iter()
            .map(|&(frames, mean, _)| frames as f64 * mean)
            .sum();
        Sequence {
            features: self.features(0..self.poses.len()),
            keyframes,
            contacts,
            misses: self.misses,
            fit: FitError {
                mean: sum / frames.max(1) as f64,
                max: fits.iter().fold(0.0, |max, &(.., worst)| max.max(worst)),
            },
            feet,
            pinned_to: floor.filter(|_| options.foot_cleanup),
            clip: Clip {
                name: name.into(),
                skeleton: skeleton.clone(),
                frame_time: self.request.frame_time,
                poses: self.poses,
            },
        }
    }
}

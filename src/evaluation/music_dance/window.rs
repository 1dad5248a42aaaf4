//! What is measured of one window, and summed over windows.

use std::ops::Range;

use glam::{DQuat, DVec3};
use ndarray::Array2;

use super::answer::{Answer, numbers_of};
use super::consistency::{consistency_error, distance_about_root};
use super::geometric::GeometricFeatures;
use super::jerk::mean_jerk;
use super::kinetic::kinetic_features;
use super::request::{SEED, key_frames};
use super::smoothness::{smoothness, step_variation};
use crate::motion::facing::FacingJoints;
use crate::motion::{MissingJoint, Pose, Skeleton};

/// cm in a metre.
const CM: f64 = 100.0;

/// What is told once of all windows on a skeleton.
#[derive(Debug, Clone)]
pub(super) struct Body<'d> {
    pub skeleton: &'d Skeleton,
    facing: FacingJoints,
    relations: GeometricFeatures,
}

/// A motion by itself: the frames of a window after its seed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Character {
    pub smoothness: Option<f64>,
    /// %.
    pub step_variation: Option<f64>,
    /// m/s^3.
    pub jerk: f64,
    /// `[3 J]`, m and s.
    pub kinetic: Vec<f64>,
    /// `[32]`.
    pub geometric: Vec<f64>,
}

/// A mean that is being taken.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Mean {
    sum: f64,
    count: usize,
}

/// Means over all frames, and over those of new poses.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct AllAndNovel {
    pub all: Mean,
    pub novel: Mean,
}

/// A motion against the recorded one.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Errors {
    /// At key frames.
    pub consistency: AllAndNovel,
    /// At key frames, cm.
    pub key_pose: AllAndNovel,
    /// At all frames after the seed, cm.
    pub position: AllAndNovel,
}

impl<'d> Body<'d> {
    pub fn of(skeleton: &'d Skeleton) -> Result<Self, MissingJoint> {
        Ok(Self {
            skeleton,
            facing: FacingJoints::of(skeleton)?,
            relations: GeometricFeatures::of(skeleton)?,
        })
    }

    /// Of the poses of a whole window, its seed first.
    ///
    /// Rotations are those in the window's own orientation: the body faces +Z in the last frame of
    /// the seed.
    pub fn character(&self, poses: &[Pose]) -> Character {
        let seed = poses.get(SEED - 1);
        let angle = seed.map_or(0.0, |pose| {
            self.facing.angle(&pose.world_positions(self.skeleton))
        });
        let turn = DQuat::from_rotation_y(-angle);
        let scored = poses.get(SEED..).unwrap_or_default();
        let numbers = scored.iter().flat_map(|pose| {
            let mut turned = pose.clone();
            if let Some(root) = turned.rotations.first_mut() {
                *root = turn * *root;
            }
            numbers_of(&turned)
        });
        let numbers: Vec<f64> = numbers.collect();
        let shape = (scored.len(), 6 * self.skeleton.len());
        // A pose has a rotation for each joint.
        let numbers = Array2::from_shape_vec(shape, numbers).unwrap_or_default();
        let world = self.skeleton.world_positions(scored);
        let metres: Vec<Vec<DVec3>> = world
            .iter()
            .map(|joints| joints.iter().map(|joint| *joint / CM).collect())
            .collect();
        Character {
            smoothness: smoothness(numbers.view()),
            step_variation: step_variation(numbers.view()),
            jerk: mean_jerk(&metres),
            kinetic: kinetic_features(&metres),
            geometric: self.relations.shares(&world).to_vec(),
        }
    }

    /// Of an answer against the recorded poses of the same frames; `novel`: those of its frames
    /// whose poses are new.
    pub fn errors(&self, recorded: &[Pose], answer: &Answer, novel: &[Range<usize>]) -> Errors {
        let is_novel = |frame: usize| novel.iter().any(|range| range.contains(&frame));
        let mut errors = Errors::default();
        let mut keys = key_frames(recorded.len()).peekable();
        let frames = recorded.iter().zip(&answer.poses).enumerate();
        for (frame, (wanted, made)) in frames.skip(SEED) {
            let [wanted_at, made_at] = [wanted, made].map(|it| it.world_positions(self.skeleton));
            let distance = distance_about_root(&wanted_at, &made_at);
            errors.position.add(distance, is_novel(frame));
            if keys.next_if_eq(&frame).is_some() {
                let [wanted, made] = [numbers_of(wanted), answer.given_numbers(frame)];
                let error = consistency_error(&wanted, &made);
                errors.consistency.add(error, is_novel(frame));
                errors.key_pose.add(distance, is_novel(frame));
            }
        }
        errors
    }
}

impl Mean {
    pub fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1;
    }

    fn join(&mut self, other: &Self) {
        self.sum += other.sum;
        self.count += other.count;
    }

    /// None of nothing.
    pub fn value(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }
}

impl FromIterator<f64> for Mean {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut mean = Self::default();
        values.into_iter().for_each(|value| mean.add(value));
        mean
    }
}

impl AllAndNovel {
    fn add(&mut self, value: f64, is_novel: bool) {
        self.all.add(value);
        if is_novel {
            self.novel.add(value);
        }
    }

    fn join(&mut self, other: &Self) {
        self.all.join(&other.all);
        self.novel.join(&other.novel);
    }
}

impl Errors {
    /// With those of another window.
    pub fn join(&mut self, other: &Self) {
        self.consistency.join(&other.consistency);
        self.key_pose.join(&other.key_pose);
        self.position.join(&other.position);
    }

    /// Whether a frame of new poses is among them.
    pub fn has_novel(&self) -> bool {
        self.position.novel.count > 0
    }
}

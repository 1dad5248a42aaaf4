//! The 154 numbers of a frame (section 3.1): what the networks read and write.

use std::ops::Range;

use glam::{DQuat, DVec3};
use ndarray::{Array2, ArrayViewMut1, s};
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::clip::Clip;
use super::contact::{FOOT_JOINTS, contacts};
use super::facing::{FacingJoints, facing_angles};
use super::skeleton::Skeleton;
use super::velocity_factor::velocity_factors;

/// p^b: positions of the 23 joints relative to the root, turned to face +Z, cm.
pub const BODY_POSITIONS: Range<usize> = 0..69;
/// p^r: the root's position in the world, cm.
pub const ROOT_POSITION: Range<usize> = 69..72;
/// p^b and p^r together, whose differences are the velocities.
pub const POSITIONS: Range<usize> = BODY_POSITIONS.start..ROOT_POSITION.end;
/// o^r: the facing angle about Y that was turned away, rad.
pub const FACING: Range<usize> = 72..73;
/// c: contact labels of LeftFoot, LeftToeBase, RightFoot, RightToeBase.
pub const CONTACTS: Range<usize> = 73..77;
/// v^b: p^b minus that of the frame before, cm/frame.
pub const BODY_VELOCITIES: Range<usize> = 77..146;
/// v^r: p^r minus that of the frame before, cm/frame.
pub const ROOT_VELOCITY: Range<usize> = 146..149;
/// f: velocity factors of trunk, left leg, right leg, right arm, left arm (eq. 1), cm/frame.
pub const VELOCITY_FACTORS: Range<usize> = 149..154;
/// How many of the numbers a model predicts: all but the velocity factors.
pub const FRAME: usize = 149;
/// How many numbers a frame has.
pub const FEATURES: usize = 154;

/// The widest smoothing of the facing direction, frames; far wider than any clip is long.
const LONGEST_SIGMA: f64 = 1e4;

/// How features are made from a clip.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeatureConfig {
    /// A foot joint is in contact while its squared speed is below this, (cm/frame)^2.
    pub contact_threshold: f64,
    /// Standard deviation of the Gaussian that smooths the facing direction, frames.
    pub facing_sigma: f64,
}

impl Default for FeatureConfig {
    fn default() -> Self {
        Self {
            contact_threshold: 0.2,
            facing_sigma: 20.0,
        }
    }
}

/// Why a clip has no features.
#[derive(Debug, Error, PartialEq)]
pub enum FeatureError {
    /// The clip is not on the 24 joints.
    #[error(
        "{clip}: joint {index} is {found}, the dance skeleton has {expected} there; \
         give a mapping file that names the clip's joints for the 24 of the dance skeleton"
    )]
    NotTheDanceSkeleton {
        clip: String,
        index: usize,
        expected: String,
        found: String,
    },
    #[error("{clip}: has no frames")]
    NoFrames { clip: String },
    /// A setting that no clip can be measured with.
    #[error("{key} = {value}: expected {expected}")]
    Config {
        key: &'static str,
        value: f64,
        expected: &'static str,
    },
}

/// Features of every frame of a clip on the dance skeleton, `[frames, 154]`, not standardised.
///
/// Velocities are per-frame differences at the clip's own rate: bring a clip to 30 fps first. The
/// first frame has velocity 0, and so velocity factors 0.
///
/// # Errors
/// The clip is on another skeleton or has no frames; a setting is not a positive number.
pub fn features(clip: &Clip, config: &FeatureConfig) -> Result<Array2<f64>, FeatureError> {
    config.check(&clip.name, &clip.skeleton, clip.poses.len())?;
    let world = clip.skeleton.world_positions(&clip.poses);
    let facing = facing_angles(&world, &FacingJoints::DANCE, config.facing_sigma);
    Ok(features_facing(&world, &facing, config.contact_threshold))
}

/// Features of frames in a row whose facing angles (rad) are known, `[frames, 154]`, not
/// standardised; the first has the labels of the second and velocity 0.
///
/// `world`: world positions of the 24 joints, `[frames][24]`, cm; `contact_threshold` as in
/// [`FeatureConfig`].
pub fn features_facing(
    world: &[Vec<DVec3>],
    facing: &[f64],
    contact_threshold: f64,
) -> Array2<f64> {
    let contacts = contacts(world, FOOT_JOINTS, contact_threshold);
    let mut features = Array2::zeros((world.len(), FEATURES));
    for (time, (positions, &facing)) in world.iter().zip(facing).enumerate() {
        let mut frame = features.row_mut(time);
        write_positions(&mut frame, positions, facing);
        for (slot, label) in CONTACTS.zip(contacts[time]) {
            frame[slot] = label;
        }
    }
    write_velocities(&mut features);
    for time in 1..world.len() {
        let velocities =
            std::array::from_fn(|number| features[[time, BODY_VELOCITIES.start + number]]);
        for (slot, factor) in VELOCITY_FACTORS.zip(velocity_factors(&velocities)) {
            features[[time, slot]] = factor;
        }
    }
    features
}

/// Writes p^b = R_y(-o^r) (p - p^r), p^r and o^r of one frame, from the world positions of its 24
/// joints (cm) and its facing angle (rad). `frame`: 149 or 154 numbers; panics on fewer than 73.
pub fn write_positions(frame: &mut ArrayViewMut1<f64>, positions: &[DVec3], facing: f64) {
    let root = positions[0];
    let turn = DQuat::from_rotation_y(-facing);
    for (joint, &position) in positions.iter().enumerate().skip(1) {
        let relative = (turn * (position - root)).to_array();
        for (axis, value) in relative.into_iter().enumerate() {
            frame[BODY_POSITIONS.start + 3 * (joint - 1) + axis] = value;
        }
    }
    for (slot, value) in ROOT_POSITION.zip(root.to_array()) {
        frame[slot] = value;
    }
    frame[FACING.start] = facing;
}

/// Writes v^b and v^r of all rows but the first, as the differences of p^b and p^r. `rows`: frames
/// in a row, `[frames, 149 or 154]`, cm.
pub fn write_velocities(rows: &mut Array2<f64>) {
    for row in 1..rows.nrows() {
        for (velocities, positions) in [
            (BODY_VELOCITIES, BODY_POSITIONS),
            (ROOT_VELOCITY, ROOT_POSITION),
        ] {
            let change =
                &rows.slice(s![row, positions.clone()]) - &rows.slice(s![row - 1, positions]);
            rows.slice_mut(s![row, velocities]).assign(&change);
        }
    }
}

impl FeatureConfig {
    /// Refuses what has no features: `clip` is its name, `frames` how many it has.
    ///
    /// # Errors
    /// As [`features`].
    pub fn check(
        &self,
        clip: &str,
        skeleton: &Skeleton,
        frames: usize,
    ) -> Result<(), FeatureError> {
        if let Some((index, expected, found)) = skeleton.difference_from_dance() {
            return Err(FeatureError::NotTheDanceSkeleton {
                clip: clip.into(),
                index,
                expected,
                found,
            });
        }
        if frames == 0 {
            return Err(FeatureError::NoFrames { clip: clip.into() });
        }
        let (threshold, sigma) = (self.contact_threshold, self.facing_sigma);
        let fault = |key, value, expected| {
            Err(FeatureError::Config {
                key,
                value,
                expected,
            })
        };
        if !(threshold > 0.0 && threshold.is_finite()) {
            return fault("contact_threshold", threshold, "a positive number");
        }
        if !(sigma > 0.0 && sigma <= LONGEST_SIGMA) {
            let expected = "a number of frames above 0 and at most 10000";
            return fault("facing_sigma", sigma, expected);
        }
        Ok(())
    }
}

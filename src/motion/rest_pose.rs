//! Whether a joint's rotation means the same on two skeletons.

use glam::{DQuat, DVec3};

use super::fit::{RotationFitError, fit_rotations};
use super::{Pose, Skeleton};

/// Bones below this share of the length of all are too short to have a direction: about 1 cm.
const SHORT: f64 = 1.0 / 600.0;
/// Rest directions of a bone may differ by this between two dancers, rad.
const REST: f64 = 0.5;

/// Where the bone that ends at each joint points at rest, in its parent's frame, `[joints]`, length
/// 1; 0 for the root and for bones too short to have a direction.
pub fn rest_directions(skeleton: &Skeleton) -> Vec<DVec3> {
    let bones = skeleton.joints.iter().map(|joint| match joint.parent {
        Some(_) => joint.offset,
        None => DVec3::ZERO,
    });
    let all: f64 = bones.clone().map(DVec3::length).sum();
    let direction = |bone: DVec3| match bone.length() {
        length if length > SHORT * all => bone / length,
        _ => DVec3::ZERO,
    };
    bones.map(direction).collect()
}

/// The joint whose bone points furthest from where it points on the other skeleton, and by how
/// much, rad, where the two have not the same rest pose: rotations of one mean other poses on the
/// other.
///
/// Both as [`rest_directions`] gives them, of the same joints.
pub fn other_rest_pose(ours: &[DVec3], theirs: &[DVec3]) -> Option<(usize, f64)> {
    let pairs = ours.iter().zip(theirs).enumerate();
    let known = pairs.filter(|(_, (a, b))| **a != DVec3::ZERO && **b != DVec3::ZERO);
    let apart = known.map(|(joint, (a, b))| (joint, a.angle_between(*b)));
    let widest = apart.max_by(|(_, one), (_, other)| one.total_cmp(other));
    widest.filter(|(_, apart)| *apart > REST)
}

/// Joints with the directions that their bones have at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestPose<'a> {
    /// Names and parents.
    pub skeleton: &'a Skeleton,
    /// As [`rest_directions`] gives them.
    pub directions: &'a [DVec3],
}

impl RestPose<'_> {
    /// Whether a skeleton of the same joints has it, so that rotations mean the same poses.
    pub fn is_of(&self, skeleton: &Skeleton) -> bool {
        other_rest_pose(self.directions, &rest_directions(skeleton)).is_none()
    }

    /// Successive poses of a skeleton of the same joints on one with this rest pose and the lengths
    /// that bones have in the first of them; and this skeleton. Joints come to the same places, as
    /// near as their bones reach; the twist of a limb is that of the shortest way from the rest
    /// pose.
    ///
    /// # Errors
    /// No poses, or none of such a skeleton.
    pub fn onto(
        &self,
        skeleton: &Skeleton,
        poses: &[Pose],
    ) -> Result<(Skeleton, Vec<Pose>), RotationFitError> {
        let first = poses.first().ok_or(RotationFitError::NoFrames)?;
        let mut stood = skeleton.clone();
        let mut start = Pose {
            translations: first.translations.clone(),
            rotations: vec![DQuat::IDENTITY; skeleton.len()],
        };
        let bones = stood.joints.iter_mut().zip(&mut start.translations);
        for ((joint, bone), direction) in bones.zip(self.directions).skip(1) {
            if *direction != DVec3::ZERO {
                *bone = *direction * bone.length();
            }
            joint.offset = *bone;
        }
        let places: Vec<Vec<DVec3>> = poses
            .iter()
            .map(|pose| pose.world_positions(skeleton))
            .collect();
        let fit = fit_rotations(&stood, &places, &start, None)?;
        Ok((stood, fit.poses))
    }
}

//! From joint positions to joint rotations, bone lengths held: what a BVH file needs of a predicted motion.

use glam::{DQuat, DVec3};

use super::rotation_fit::best_rotation;
use super::{Pose, Skeleton};

/// Joint rotations for a motion that was given by positions.
#[derive(Debug, Clone, PartialEq)]
pub struct RotationFit {
    /// One pose a frame: the root where it was asked for, all other translations as in the start pose.
    pub poses: Vec<Pose>,
    /// Mean over frames and joints of the distance from the asked position to the one the pose has, cm.
    pub mean_error: f64,
    /// The largest of these distances, cm.
    pub max_error: f64,
}

/// Why positions cannot be turned into rotations.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RotationFitError {
    #[error("{what} has {found} joints, the skeleton has {expected}")]
    Joints {
        what: String,
        found: usize,
        expected: usize,
    },
    #[error("frame {frame}, joint {joint}: the position is not a finite number")]
    NotFinite { frame: usize, joint: String },
    #[error("there are no frames to fit rotations to")]
    NoFrames,
}

/// Finds rotations whose forward kinematics come near the given world positions, `positions[frame][joint]`, cm.
///
/// Bone lengths are those of `start`, the pose of the frame before the first (the keyframe k1), so positions whose bones are longer or
/// shorter cannot be met; the fit's errors say by how much. From the root outwards each joint is turned from its local rotation
/// in the frame before, under its parent's new rotation:
///
/// - with several children, so that the sum of squared distances to their positions is least;
/// - with one child, by the shortest arc that points it at the child. Positions do not tell the twist about a bone; it is
///   whatever the shortest arcs leave;
/// - without children, not at all.
///
/// # Errors
///
/// [`RotationFitError`]: no frames, a wrong number of joints, a NaN or infinity.
pub fn fit_rotations(
    skeleton: &Skeleton,
    positions: &[impl AsRef<[DVec3]>],
    start: &Pose,
) -> Result<RotationFit, RotationFitError> {
    check(skeleton, positions, start)?;
    let children = children(skeleton);
    let mut poses: Vec<Pose> = Vec::with_capacity(positions.len());
    let (mut sum, mut max_error) = (0.0, 0.0f64);
    for wanted in positions {
        let wanted = wanted.as_ref();
        let pose = fit_frame(skeleton, &children, wanted, poses.last().unwrap_or(start));
        for (found, wanted) in pose.world_positions(skeleton).iter().zip(wanted) {
            let error = found.distance(*wanted);
            sum += error;
            max_error = max_error.max(error);
        }
        poses.push(pose);
    }
    Ok(RotationFit {
        mean_error: sum / (positions.len() * skeleton.len()) as f64,
        max_error,
        poses,
    })
}

fn check(
    skeleton: &Skeleton,
    positions: &[impl AsRef<[DVec3]>],
    start: &Pose,
) -> Result<(), RotationFitError> {
    if positions.is_empty() {
        return Err(RotationFitError::NoFrames);
    }
    let expected = skeleton.len();
    let counts = [
        (
            "the start pose's translations".to_string(),
            start.translations.len(),
        ),
        (
            "the start pose's rotations".to_string(),
            start.rotations.len(),
        ),
    ];
    let frames = positions.iter().enumerate();
    let frames = frames.map(|(frame, joints)| (format!("frame {frame}"), joints.as_ref().len()));
    for (what, found) in counts.into_iter().chain(frames) {
        if found != expected {
            return Err(RotationFitError::Joints {
                what,
                found,
                expected,
            });
        }
    }
    for (frame, joints) in positions.iter().enumerate() {
        for (position, joint) in joints.as_ref().iter().zip(&skeleton.joints) {
            if !position.is_finite() {
                return Err(RotationFitError::NotFinite {
                    frame,
                    joint: joint.name.clone(),
                });
            }
        }
    }
    Ok(())
}

/// Children of each joint.
fn children(skeleton: &Skeleton) -> Vec<Vec<usize>> {
    let mut children = vec![Vec::new(); skeleton.len()];
    for (index, joint) in skeleton.joints.iter().enumerate() {
        if let Some(parent) = joint.parent {
            children[parent].push(index);
        }
    }
    children
}

/// The pose near `wanted`, starting from the pose `before`.
fn fit_frame(
    skeleton: &Skeleton,
    children: &[Vec<usize>],
    wanted: &[DVec3],
    before: &Pose,
) -> Pose {
    let mut pose = before.clone();
    let mut positions = Vec::with_capacity(skeleton.len());
    let mut rotations: Vec<DQuat> = Vec::with_capacity(skeleton.len());
    for (index, joint) in skeleton.joints.iter().enumerate() {
        let parent = joint
            .parent
            .map_or(DQuat::IDENTITY, |parent| rotations[parent]);
        match joint.parent {
            Some(up) => positions.push(positions[up] + parent * pose.translations[index]),
            None => {
                pose.translations[index] = wanted[index];
                positions.push(wanted[index]);
            }
        }
        let propagated = parent * pose.rotations[index];
        let directions: Vec<(DVec3, DVec3)> = children[index]
            .iter()
            .map(|&child| {
                let now = propagated * pose.translations[child];
                (now, wanted[child] - positions[index])
            })
            .filter(|(now, wanted)| now.length() > 1e-9 && wanted.length() > 1e-9)
            .collect();
        let turned = (best_rotation(&directions) * propagated).normalize();
        pose.rotations[index] = (parent.inverse() * turned).normalize();
        rotations.push(turned);
    }
    pose
}

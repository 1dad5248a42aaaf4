//! A recorded motion: one pose a frame on one skeleton, and forward kinematics.

use glam::{DQuat, DVec3};

use super::skeleton::Skeleton;

/// The local transforms of all joints in one frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// Translation of each joint in its parent's frame, `[joints]`, cm: the root's position in the
    /// world, the offset of a joint without position channels, what the channels say of a joint
    /// that has them.
    pub translations: Vec<DVec3>,
    /// Rotation of each joint in its parent's frame, `[joints]`.
    pub rotations: Vec<DQuat>,
}

impl Pose {
    /// World position (cm) and rotation of every joint, `[joints]`.
    pub fn world(&self, skeleton: &Skeleton) -> (Vec<DVec3>, Vec<DQuat>) {
        let mut positions = Vec::with_capacity(skeleton.len());
        let mut rotations: Vec<DQuat> = Vec::with_capacity(skeleton.len());
        for (index, joint) in skeleton.joints.iter().enumerate() {
            let (position, rotation) = match joint.parent {
                None => (self.translations[index], self.rotations[index]),
                Some(parent) => (
                    positions[parent] + rotations[parent] * self.translations[index],
                    (rotations[parent] * self.rotations[index]).normalize(),
                ),
            };
            positions.push(position);
            rotations.push(rotation);
        }
        (positions, rotations)
    }

    /// The pose at a share of the way from this one to `other`: translations linearly, rotations
    /// along the shorter arc.
    pub fn towards(&self, other: &Self, share: f64) -> Self {
        let translations = self.translations.iter().zip(&other.translations);
        let rotations = self.rotations.iter().zip(&other.rotations);
        Self {
            translations: translations.map(|(a, b)| a.lerp(*b, share)).collect(),
            rotations: rotations
                .map(|(a, b)| a.slerp(*b, share).normalize())
                .collect(),
        }
    }

    /// World position of every joint, `[joints]`, cm.
    pub fn world_positions(&self, skeleton: &Skeleton) -> Vec<DVec3> {
        self.world(skeleton).0
    }
}

/// A motion clip.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    /// Name of the clip: the file's name with its extension, where it came from a file.
    pub name: String,
    pub skeleton: Skeleton,
    /// Seconds from one frame to the next.
    pub frame_time: f64,
    pub poses: Vec<Pose>,
}

impl Skeleton {
    /// Every joint at its offset, all rotations 0.
    pub fn rest_pose(&self) -> Pose {
        Pose {
            translations: self.joints.iter().map(|joint| joint.offset).collect(),
            rotations: vec![DQuat::IDENTITY; self.len()],
        }
    }

    /// World positions of the joints in every pose, `[poses][joints]`, cm.
    pub fn world_positions(&self, poses: &[Pose]) -> Vec<Vec<DVec3>> {
        let poses = poses.iter();
        poses.map(|pose| pose.world_positions(self)).collect()
    }
}

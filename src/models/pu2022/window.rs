//! A window as the network sees it: in the frame of reference of its seed's last frame.

use glam::{DQuat, DVec3};

use crate::motion::facing::FacingJoints;
use crate::motion::rotation_6d::{from_6d, rotation_6d};
use crate::motion::{Pose, Skeleton};

/// Centimetres of the unit of root positions, the metre: that of the paper's data, so that the
/// terms of the loss weigh as its authors' did.
const METRE: f64 = 100.0;

/// The frame of reference of a window (spec, section 3): the body at the seed's last frame faces
/// +Z, its root's x and z are 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowFrame {
    /// From the world's orientation to the window's.
    turn: DQuat,
    /// Place of the root at the seed's last frame on the ground, cm.
    origin: DVec3,
}

impl WindowFrame {
    /// That of a seed with this last pose.
    pub fn of(skeleton: &Skeleton, facing: &FacingJoints, last: &Pose) -> Self {
        let world = last.world_positions(skeleton);
        Self {
            turn: DQuat::from_rotation_y(-facing.angle(&world)),
            origin: DVec3::new(world[0].x, 0.0, world[0].z),
        }
    }

    /// y_t, a pose in numbers of the window, `[6 J + 3]`: of every joint the first and the second
    /// column of its local rotation's matrix, the root's in the window's orientation; then the
    /// root's place, m.
    pub fn numbers(&self, pose: &Pose) -> Vec<f64> {
        let root = self.turn * (pose.translations[0] - self.origin) / METRE;
        let mut numbers = self.key_pose(pose);
        numbers.extend(root.to_array());
        numbers
    }

    /// A key pose in numbers of the window, `[6 J]`: where its root is, it does not say.
    pub fn key_pose(&self, pose: &Pose) -> Vec<f64> {
        let local = |(joint, q): (usize, &DQuat)| match joint {
            0 => rotation_6d(self.turn * *q),
            _ => rotation_6d(*q),
        };
        pose.rotations.iter().enumerate().flat_map(local).collect()
    }

    /// Numbers of the window, `[6 J + 3]`, turned and moved back into the world, before they are
    /// made rotations; the root's place, m.
    pub fn to_world(&self, numbers: &[f64]) -> Vec<f64> {
        let back = self.turn.inverse();
        let mut world = numbers.to_vec();
        for column in world[..6].chunks_exact_mut(3) {
            let turned = back * DVec3::from_slice(column);
            column.copy_from_slice(&turned.to_array());
        }
        let root = world.len() - 3;
        let place = back * DVec3::from_slice(&numbers[root..]) + self.origin / METRE;
        world[root..].copy_from_slice(&place.to_array());
        world
    }
}

/// Numbers in the world, `[6 J + 3]`, as a pose on the bones of another.
pub fn pose_of(numbers: &[f64], bones: &Pose) -> Pose {
    let (rotations, root) = numbers.split_at(numbers.len() - 3);
    let mut translations = bones.translations.clone();
    translations[0] = DVec3::from_slice(root) * METRE;
    let columns = rotations.chunks_exact(6);
    Pose {
        translations,
        rotations: columns
            .map(|it| from_6d([it[0], it[1], it[2], it[3], it[4], it[5]]))
            .collect(),
    }
}

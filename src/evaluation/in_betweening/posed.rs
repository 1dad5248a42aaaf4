//! Frames as the scores see them.

use glam::{DQuat, DVec3};

use crate::motion::{Pose, Skeleton};

/// Rotations and positions of every joint, `[frames][joints]`.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedFrames {
    /// In the parent's frame; the root's in the world.
    pub local: Vec<Vec<DQuat>>,
    /// In the world.
    pub global: Vec<Vec<DQuat>>,
    /// In the world, cm.
    pub world: Vec<Vec<DVec3>>,
}

impl PosedFrames {
    /// By forward kinematics.
    pub fn of(skeleton: &Skeleton, poses: impl Iterator<Item = Pose>) -> Self {
        let mut frames = Self::default();
        for pose in poses {
            let (world, global) = pose.world(skeleton);
            frames.world.push(world);
            frames.global.push(global);
            frames.local.push(pose.rotations);
        }
        frames
    }

    /// Positions minus the root's in a frame, `[joints]`, cm.
    pub fn relative(&self, frame: usize) -> Vec<DVec3> {
        let world = &self.world[frame];
        world.iter().map(|position| position - world[0]).collect()
    }
}

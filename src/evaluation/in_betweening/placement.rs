//! Where a window lies in the scores, and which way it looks: truth and prediction are moved
//! together.

use glam::{DQuat, DVec3};

use crate::motion::facing::FacingJoints;
use crate::motion::{Pose, Skeleton};

/// What is turned to a fixed direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Heading {
    /// The root's local +Y, its part in the ground's plane, to +X: as in the public benchmark of
    /// LaFAN1, where it is the way that the hips look.
    RootUp,
    /// The way that the body looks, by itself and unsmoothed, to +Z.
    Body(FacingJoints),
}

/// A turn about Y, after the window's mean place in the ground's plane is taken off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    turn: DQuat,
    centre: DVec3,
}

impl Placement {
    /// That of a window of recorded poses, `[frames]`, by how it looks in one of its frames.
    pub fn of(heading: &Heading, skeleton: &Skeleton, window: &[Pose], at: usize) -> Self {
        let angle = match heading {
            Heading::RootUp => {
                let forward = window[at].rotations[0] * DVec3::Y;
                (-forward.z).atan2(forward.x)
            }
            Heading::Body(joints) => joints.angle(&window[at].world_positions(skeleton)),
        };
        let roots = window.iter().map(|pose| pose.translations[0]);
        let mean = roots.sum::<DVec3>() / window.len() as f64;
        Self {
            turn: DQuat::from_rotation_y(-angle),
            centre: DVec3::new(mean.x, 0.0, mean.z),
        }
    }

    /// Where a place in the world comes to lie, cm.
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.turn * (point - self.centre)
    }

    /// The pose there.
    pub fn pose(&self, pose: &Pose) -> Pose {
        let mut placed = pose.clone();
        placed.translations[0] = self.point(pose.translations[0]);
        placed.rotations[0] = self.turn * pose.rotations[0];
        placed
    }
}

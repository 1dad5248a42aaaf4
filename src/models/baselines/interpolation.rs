//! The baseline "Interpolation": joint rotations slerped between the keyframes, on the given root
//! trajectory.

use glam::{DQuat, DVec3};

use super::{facing_between, transitions};
use crate::models::ModelError;
use crate::models::transition::{KeyframePose, Transition, TransitionModel, TransitionRequest};
use crate::motion::features::{BODY_POSITIONS, FACING};
use crate::motion::{Pose, Skeleton};

/// Spherical interpolation between the keyframes (the row "Interpolation" of table 2). Nothing is
/// learned.
///
/// Each pose is first turned about Y to face +Z: its root's rotation becomes `R_y(-o^r) R`. Local
/// rotations are slerped along the shorter arc, local translations interpolated linearly, and
/// forward kinematics with the root at the origin gives p^b. p^r is the given trajectory. o^r goes
/// the shorter way round. Velocities are differences of positions, and a contact label is 1 where
/// the joint's squared speed in the world is below [`Interpolation::contact_threshold`].
///
/// The last frame, k2, has p^b of the target keyframe.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolation {
    /// Squared world speed below which a foot joint counts as planted, (cm/frame)^2.
    pub contact_threshold: f64,
}

impl Default for Interpolation {
    fn default() -> Self {
        Self {
            contact_threshold: 0.2,
        }
    }
}

impl TransitionModel for Interpolation {
    fn name(&self) -> &str {
        "interpolation"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        transitions(
            requests,
            self.contact_threshold,
            |request, share, mut row| {
                let (start, target) = (&request.start, &request.target);
                let pose = facing_pose(start).towards(&facing_pose(target), share);
                let body = body_positions(&pose, &request.skeleton);
                for (column, position) in BODY_POSITIONS.step_by(3).zip(&body) {
                    row[column] = position.x;
                    row[column + 1] = position.y;
                    row[column + 2] = position.z;
                }
                row[FACING.start] = facing_between(request, share);
            },
        )
    }
}

/// The keyframe's pose turned about Y to face +Z.
fn facing_pose(keyframe: &KeyframePose) -> Pose {
    let mut pose = keyframe.pose.clone();
    let turned = DQuat::from_rotation_y(-keyframe.features[FACING.start]);
    pose.rotations[0] = turned * pose.rotations[0];
    pose
}

/// Positions of the 23 joints other than the root, relative to the root, in the pose's own frame.
fn body_positions(pose: &Pose, skeleton: &Skeleton) -> Vec<DVec3> {
    let mut at_origin = pose.clone();
    at_origin.translations[0] = DVec3::ZERO;
    at_origin.world_positions(skeleton).split_off(1)
}

//! The dancer's body: rest offsets of the dance skeleton with human proportions, cm.
//!
//! At rest the body stands in a T: Y up, facing +Z, the left side at +X.

use glam::DVec3;

use crate::motion::{DANCE_JOINTS, DANCE_PARENTS, Joint, Skeleton};

/// Indices into the joints of the dance skeleton.
pub const HIPS: usize = 0;
/// First joint of the spine.
pub const SPINE: usize = 9;
/// Joints of the spine, `Spine` to `Spine4`.
pub const SPINE_JOINTS: usize = 5;
/// Neck, followed by the head.
pub const NECK: usize = 22;
/// Head.
pub const HEAD: usize = 23;
/// `UpLeg` of the left and right leg; `Leg`, `Foot` and `ToeBase` follow.
pub const LEGS: [usize; 2] = [1, 5];
/// `Shoulder` of the left and right arm; `Arm`, `ForeArm` and `Hand` follow.
pub const ARMS: [usize; 2] = [18, 14];

/// Length of the thigh, cm.
pub const THIGH: f64 = 43.0;
/// Length of the shin, cm.
pub const SHIN: f64 = 41.0;
/// Height of the ankle over the ball of the foot, cm.
pub const ANKLE_RISE: f64 = 6.5;
/// Distance of the ball of the foot before the ankle, cm.
pub const FOOT_LENGTH: f64 = 11.0;
/// Height of the ball joint of a planted foot, cm.
pub const BALL_HEIGHT: f64 = 2.5;
/// Half the distance between the hip joints, cm.
pub const HIP_HALF_WIDTH: f64 = 8.5;
/// How far below the root the hip joints hang, cm.
pub const HIP_DROP: f64 = 3.0;
/// Height of the root over the floor with straight legs, cm.
pub const STANDING: f64 = BALL_HEIGHT + ANKLE_RISE + SHIN + THIGH + HIP_DROP;

/// The dance skeleton with the dancer's proportions (about 1.72 m tall).
pub fn skeleton() -> Skeleton {
    let joints = DANCE_JOINTS
        .iter()
        .zip(DANCE_PARENTS)
        .enumerate()
        .map(|(index, (name, parent))| Joint {
            name: (*name).to_string(),
            parent,
            offset: offset(index),
            end_sites: end_site(index).into_iter().collect(),
        })
        .collect();
    Skeleton { joints }
}

fn offset(joint: usize) -> DVec3 {
    let (x, y, z) = match joint {
        1 => (HIP_HALF_WIDTH, -HIP_DROP, 0.0),
        5 => (-HIP_HALF_WIDTH, -HIP_DROP, 0.0),
        2 | 6 => (0.0, -THIGH, 0.0),
        3 | 7 => (0.0, -SHIN, 0.0),
        4 | 8 => (0.0, -ANKLE_RISE, FOOT_LENGTH),
        9 => (0.0, 6.5, -1.0),
        10 => (0.0, 7.5, -1.0),
        11 => (0.0, 12.0, 0.0),
        12 => (0.0, 14.0, 0.5),
        13 => (0.0, 10.0, 1.0),
        14 => (-3.5, 1.5, 0.0),
        18 => (3.5, 1.5, 0.0),
        15 => (-13.5, 0.0, 0.0),
        19 => (13.5, 0.0, 0.0),
        16 => (-28.0, 0.0, 0.0),
        20 => (28.0, 0.0, 0.0),
        17 => (-25.5, 0.0, 0.0),
        21 => (25.5, 0.0, 0.0),
        22 => (0.0, 6.0, 0.5),
        23 => (0.0, 9.0, 1.5),
        _ => (0.0, 0.0, 0.0),
    };
    DVec3::new(x, y, z)
}

fn end_site(joint: usize) -> Option<DVec3> {
    match joint {
        4 | 8 => Some(DVec3::new(0.0, -0.5, 3.0)),
        17 => Some(DVec3::new(-15.0, 0.0, 0.0)),
        21 => Some(DVec3::new(15.0, 0.0, 0.0)),
        23 => Some(DVec3::new(0.0, 17.0, 1.0)),
        _ => None,
    }
}

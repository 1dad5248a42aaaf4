//! The mirror image of a clip: left and right change places.

use glam::{DQuat, DVec3};

use super::clip::{Clip, Pose};
use super::skeleton::{Joint, Skeleton};

/// A clip on the dance skeleton as it is seen in a mirror in the plane X = 0, the skeleton and what
/// the joints are called included: LeftHand of the image moves as RightHand of the clip does.
pub fn mirror_image(clip: &Clip) -> Clip {
    let partners = partners(&clip.skeleton);
    Clip {
        name: clip.name.clone(),
        skeleton: mirrored_skeleton(&partners, &clip.skeleton),
        frame_time: clip.frame_time,
        poses: mirrored_poses(&partners, &clip.poses),
    }
}

/// The skeleton of a clip's [`mirror_image`]; `partners` are those of its own.
pub fn mirrored_skeleton(partners: &[usize], skeleton: &Skeleton) -> Skeleton {
    let joints = skeleton.joints.iter().zip(partners);
    Skeleton {
        joints: joints
            .map(|(joint, &partner)| reflected_joint(joint, &skeleton.joints[partner]))
            .collect(),
    }
}

/// The joint on the body's other side of each joint, `[joints]`; one in the middle is its own.
pub fn partners(skeleton: &Skeleton) -> Vec<usize> {
    (0..skeleton.len())
        .map(|joint| partner(skeleton, joint))
        .collect()
}

/// The poses of a clip's [`mirror_image`], `[frames]`; `partners` are those of its skeleton.
pub fn mirrored_poses(partners: &[usize], poses: &[Pose]) -> Vec<Pose> {
    poses
        .iter()
        .map(|pose| Pose {
            translations: partners
                .iter()
                .map(|&partner| reflected(pose.translations[partner]))
                .collect(),
            rotations: partners
                .iter()
                .map(|&partner| reflected_rotation(pose.rotations[partner]))
                .collect(),
        })
        .collect()
}

/// The joint on the body's other side; one in the middle is its own partner.
fn partner(skeleton: &Skeleton, joint: usize) -> usize {
    other_side(&skeleton.joints[joint].name)
        .and_then(|name| skeleton.index_of(&name))
        .unwrap_or(joint)
}

/// What the joint on the body's other side is called; none for one in the middle.
pub(crate) fn other_side(name: &str) -> Option<String> {
    match (name.strip_prefix("Left"), name.strip_prefix("Right")) {
        (Some(part), _) => Some(format!("Right{part}")),
        (_, Some(part)) => Some(format!("Left{part}")),
        _ => None,
    }
}

fn reflected_joint(joint: &Joint, partner: &Joint) -> Joint {
    Joint {
        name: joint.name.clone(),
        parent: joint.parent,
        offset: reflected(partner.offset),
        end_sites: partner.end_sites.iter().copied().map(reflected).collect(),
    }
}

fn reflected(place: DVec3) -> DVec3 {
    DVec3::new(-place.x, place.y, place.z)
}

/// The rotation as seen in the mirror: about the reflected axis, the other way round.
fn reflected_rotation(rotation: DQuat) -> DQuat {
    DQuat::from_xyzw(rotation.x, -rotation.y, -rotation.z, rotation.w)
}

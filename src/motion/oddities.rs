//! What a recording has that its dancer did not do.

use glam::DVec3;

use super::clip::Clip;
use super::contact_foot::Feet;
use super::facing::FacingJoints;
use crate::counted::counted;

/// A step at the beginning is a jump where its fastest joint goes this many times as far as any
/// joint in any step after the beginning.
const JUMP: f64 = 2.5;
/// And at least this share of the body's extent: further than a fist goes in a frame.
const LEAST_JUMP: f64 = 0.15;
/// A jump out of a pose that was held takes at most the beginning's part of this number.
const SMEARING: usize = 4;
/// Steps behind it belong to it that go this many times as far as any after the beginning.
const SMEARED: f64 = 1.2;
/// Nobody dances whose fastest joint goes this share of the body's extent in a frame.
const STILL: f64 = 0.005;
/// How long a beginning lasts, s, and the share of a clip that it is at most.
const BEGINNING: f64 = 1.0;
const BEGINNING_SHARE: f64 = 0.25;
/// A leg stands whose hip is this share of its length above its ankle.
const UPRIGHT: f64 = 0.8;
/// How many joints a notice names.
const NAMED: usize = 3;

/// What is odd about a clip as it was read, each in a sentence.
pub fn oddities(clip: &Clip) -> Vec<String> {
    collapsed_joints(clip)
        .into_iter()
        .chain(jump_at_the_beginning(clip))
        .collect()
}

/// What a mapping with left and right swapped makes of a clip: toes that point backwards, by where
/// hips and arms are, while the dancer stands; or, where only legs or only arms are swapped, hips
/// and shoulders that face opposite ways.
pub fn swapped_sides(clip: &Clip) -> Option<String> {
    let feet = Feet::of(&clip.skeleton).ok()?;
    let body = FacingJoints::of(&clip.skeleton).ok()?;
    let [mut ahead, mut alike] = [0.0; 2];
    for pose in &clip.poses {
        let world = pose.world_positions(&clip.skeleton);
        let across = |[left, right]: [usize; 2]| world[left] - world[right];
        alike += across(body.hips).dot(across(body.arms));
        let angle = body.angle(&world);
        let forward = DVec3::new(angle.sin(), 0.0, angle.cos());
        for side in 0..2 {
            let (hip, ankle) = (body.hips[1 - side], feet.ankles[side]);
            let leg = world[hip] - world[ankle];
            if leg.y > UPRIGHT * leg.length() {
                ahead += (world[feet.toes[side]] - world[ankle]).dot(forward);
            }
        }
    }
    let what = match () {
        () if alike < 0.0 => "hips and shoulders face opposite ways",
        () if ahead < 0.0 => "the toes point backwards",
        () => return None,
    };
    Some(format!(
        "{what}: left and right may be swapped in its mapping"
    ))
}

/// Joints that stand on their parents in every frame though their offsets do not: position channels
/// that were left at 0.
fn collapsed_joints(clip: &Clip) -> Option<String> {
    let joints = clip.skeleton.joints.iter().enumerate();
    let collapsed: Vec<&str> = joints
        .filter(|(_, joint)| joint.parent.is_some() && joint.offset.length() > 0.0)
        .filter(|(index, _)| {
            let stays = |pose: &super::Pose| pose.translations[*index] == DVec3::ZERO;
            clip.poses.iter().all(stays)
        })
        .map(|(_, joint)| joint.name.as_str())
        .collect();
    if collapsed.is_empty() || clip.poses.is_empty() {
        return None;
    }
    let dots = if collapsed.len() > NAMED { ", ..." } else { "" };
    Some(format!(
        "the position channels of {} ({}{dots}) are 0 in every frame though their offsets are not: \
         they stand on their parents",
        counted(collapsed.len(), "joint"),
        collapsed[..collapsed.len().min(NAMED)].join(", ")
    ))
}

/// First frames, such as a T-pose, from which the clip jumps further than it ever moves afterwards.
fn jump_at_the_beginning(clip: &Clip) -> Option<String> {
    let positions: Vec<Vec<DVec3>> = clip
        .poses
        .iter()
        .map(|pose| pose.world_positions(&clip.skeleton))
        .collect();
    let steps: Vec<f64> = positions
        .windows(2)
        .map(|pair| farthest(&pair[0], &pair[1]))
        .collect();
    let frames = clip.poses.len() as f64;
    let [short, long] = [BEGINNING / clip.frame_time, f64::INFINITY]
        .map(|frames_of| frames_of.min(BEGINNING_SHARE * frames) as usize);
    let extent = extent(positions.last()?);
    // A first pose may be held for long.
    let still = steps.iter().take_while(|&&step| step < STILL * extent);
    let beginning = match still.count() {
        held if held > short => (held + 1 + short / SMEARING).min(long),
        _ => short,
    };
    // A filter smears the jump over several frames, so none of these may be compared with another.
    let (first, after) = steps.split_at(beginning.min(steps.len()));
    let fastest = after.iter().copied().reduce(f64::max)?;
    let least = (LEAST_JUMP * extent).max(JUMP * fastest);
    let jump = first.iter().rposition(|&step| step > least)?;
    let smeared = first[jump + 1..]
        .iter()
        .take_while(|&&step| step > SMEARED * fastest);
    let jump = jump + smeared.count();
    Some(format!(
        "the body jumps from frame {jump} to frame {next} as nowhere after it, which may be a T-pose before the dance; \
         data.skip_frames = {next} in a config leaves the first frames out",
        next = jump + 1
    ))
}

fn farthest(from: &[DVec3], to: &[DVec3]) -> f64 {
    let ways = from.iter().zip(to).map(|(a, b)| a.distance(*b));
    ways.fold(0.0, f64::max)
}

/// The longest edge of the box around some points.
fn extent(points: &[DVec3]) -> f64 {
    let first = points.first().copied().unwrap_or_default();
    let low = points.iter().fold(first, |low, point| low.min(*point));
    let high = points.iter().fold(first, |high, point| high.max(*point));
    (high - low).max_element()
}

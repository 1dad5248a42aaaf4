//! A stretch of a training clip, put where a dance is and bent onto its known poses.

use glam::{DQuat, DVec3};

use crate::motion::Pose;

/// The poses of a stretch after its first, on the bones of `from`.
///
/// `turn` turns the whole about Y; then it is moved along the ground so that its root starts where
/// that of `from` is. What the rotations at either end still differ from `from` and from `to`
/// fades over `frames` frames, or over the whole stretch where that is shorter; so does the height
/// of the root at the start. At its last frame it has the rotations of `to`, and its root where
/// the stretch leads.
pub(super) fn placed(
    stretch: &[Pose],
    turn: DQuat,
    from: &Pose,
    to: Option<&Pose>,
    frames: usize,
) -> Vec<Pose> {
    let [Some(first), Some(last)] = [stretch.first(), stretch.last()] else {
        return Vec::new();
    };
    let rotation = |pose: &Pose, joint: usize| match joint {
        0 => turn * pose.rotations[0],
        _ => pose.rotations[joint],
    };
    // From what the stretch has to what is known, in the joint's parent.
    let offsets = |known: &Pose, at: &Pose| -> Vec<DQuat> {
        let joints = known.rotations.iter().enumerate();
        joints
            .map(|(joint, known)| *known * rotation(at, joint).inverse())
            .collect()
    };
    let at_start = offsets(from, first);
    let at_end = to.map(|to| offsets(to, last));
    let begin = turn * first.translations[0];
    let moved = from.translations[0] - begin;
    let steps = stretch.len() - 1;
    let frames = frames.min(steps);
    let pose = |step: usize| {
        let own = &stretch[step];
        let [start, end] = [step, steps - step].map(|away| left(away, frames));
        let rotations = (0..own.rotations.len()).map(|joint| {
            let bent = part(at_start[joint], start) * rotation(own, joint);
            let at_end = at_end.as_ref().map(|offsets| part(offsets[joint], end));
            at_end.map_or(bent, |offset| offset * bent).normalize()
        });
        let mut translations = from.translations.clone();
        translations[0] = turn * own.translations[0] + moved * DVec3::new(1.0, start, 1.0);
        Pose {
            rotations: rotations.collect(),
            translations,
        }
    };
    (1..=steps).map(pose).collect()
}

/// What is left of an offset so many frames away from where it is whole: a quintic, level at both
/// ends.
fn left(away: usize, frames: usize) -> f64 {
    let s = (away as f64 / frames as f64).min(1.0);
    1.0 - s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// A share of a turn, the shorter way.
fn part(turn: DQuat, share: f64) -> DQuat {
    DQuat::IDENTITY.slerp(turn, share)
}

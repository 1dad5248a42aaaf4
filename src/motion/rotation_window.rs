//! Rotations over a window of frames: signs that are continuous in time, and interpolation between
//! keyframes.

use glam::DQuat;

/// The same rotation with the sign that lies nearer to another quaternion.
pub fn nearer_sign(q: DQuat, to: DQuat) -> DQuat {
    match q.dot(to) < 0.0 {
        true => -q,
        false => q,
    }
}

/// Gives each rotation the sign that is nearer to the one before. The first has w >= 0.
///
/// `rotations`: `[frames][joints]`.
pub fn make_continuous(rotations: &mut [Vec<DQuat>]) {
    let Some(first) = rotations.first() else {
        return;
    };
    let positive = |q: &DQuat| if q.w < 0.0 { -*q } else { *q };
    let first: Vec<DQuat> = first.iter().map(positive).collect();
    continue_from(&first, rotations);
}

/// Gives each rotation the sign that is nearer to the one before; what comes before the first is
/// `before`.
///
/// `before`: `[joints]`; `rotations`: `[frames][joints]`.
pub fn continue_from(before: &[DQuat], rotations: &mut [Vec<DQuat>]) {
    let mut before = before;
    for frame in rotations {
        let joints = frame.iter_mut().zip(before);
        joints.for_each(|(q, before)| *q = nearer_sign(*q, *before));
        before = frame;
    }
}

/// How rotations go from one keyframe to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Along the shorter arc at constant speed (Shoemake 1985).
    Slerp,
    /// Component by component along the shorter arc, not made unit.
    Linear,
}

/// Rotations `[joints]` at a share of the way between two keyframes; signs follow the first.
pub fn between(start: &[DQuat], end: &[DQuat], share: f64, along: Interpolation) -> Vec<DQuat> {
    let joints = start.iter().zip(end);
    joints
        .map(|(&start, &end)| {
            let end = nearer_sign(end, start);
            match along {
                Interpolation::Slerp => start.slerp(end, share),
                Interpolation::Linear => start * (1.0 - share) + end * share,
            }
        })
        .collect()
}

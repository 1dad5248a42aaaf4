//! Velocity factors: how fast each of the five body parts moves (eq. 1).

use ndarray::{ArrayView1, ArrayView2};

use super::features::POSITIONS;

/// Number of body parts (M = 5).
pub const PARTS: usize = 5;

/// Names of the body parts, in the order of every velocity factor.
pub const PART_NAMES: [&str; PARTS] = ["trunk", "left_leg", "right_leg", "right_arm", "left_arm"];

/// Joint weights of each body part (figure 4): `(joint of the dance skeleton, weight)`.
///
/// Parts in the order trunk, left leg, right leg, right arm, left arm.
pub const PART_WEIGHTS: [&[(usize, f64)]; PARTS] = [
    &[
        (0, 1.0),
        (9, 1.0),
        (10, 1.0),
        (11, 1.0),
        (12, 1.0),
        (13, 1.0),
        (22, 1.0),
        (23, 2.0),
    ],
    &[(1, 1.0), (2, 2.0), (3, 3.0), (4, 4.0)],
    &[(5, 1.0), (6, 2.0), (7, 3.0), (8, 4.0)],
    &[(14, 1.0), (15, 2.0), (16, 3.0), (17, 4.0)],
    &[(18, 1.0), (19, 2.0), (20, 3.0), (21, 4.0)],
];

/// Eq. 1: the weighted mean speed of each part's joints, `[5]`, in the unit of `velocities`
/// (cm/frame).
///
/// `velocities` are v^b and v^r in one row, as they stand in a frame's features: joints 1..24, then
/// the root.
pub fn velocity_factors(velocities: &[f64; 72]) -> [f64; PARTS] {
    PART_WEIGHTS.map(|part| {
        let weighted: f64 = part
            .iter()
            .map(|&(joint, weight)| weight * speed(velocities, joint))
            .sum();
        weighted / part.iter().map(|&(_, weight)| weight).sum::<f64>()
    })
}

/// Eq. 1 for the motion from one frame to the next, `[5]`, cm/frame: the velocities are the
/// differences of p^b and p^r.
///
/// `before`, `frame`: a frame's numbers, not standardised; the velocities among them are not looked
/// at.
pub fn velocity_factors_between(before: ArrayView1<f64>, frame: ArrayView1<f64>) -> [f64; PARTS] {
    velocity_factors(&std::array::from_fn(|number| {
        let column = POSITIONS.start + number;
        frame[column] - before[column]
    }))
}

/// The velocity factors of every frame as its positions give them, `[frames][5]`, cm/frame.
///
/// `frames`: `[frames, 149 or 154]`, not standardised. The first frame, which none comes before,
/// has those of the second; a single frame has 0.
pub fn measured_velocity_factors(frames: ArrayView2<f64>) -> Vec<[f64; PARTS]> {
    let pairs = frames
        .rows()
        .into_iter()
        .zip(frames.rows().into_iter().skip(1));
    let mut factors: Vec<_> = pairs
        .map(|(before, frame)| velocity_factors_between(before, frame))
        .collect();
    if frames.nrows() > 0 {
        factors.insert(0, factors.first().copied().unwrap_or([0.0; PARTS]));
    }
    factors
}

/// Norm of one joint's velocity; the root's three numbers stand last.
fn speed(velocities: &[f64; 72], joint: usize) -> f64 {
    let at = if joint == 0 { 69 } else { 3 * (joint - 1) };
    let [x, y, z] = [velocities[at], velocities[at + 1], velocities[at + 2]];
    (x * x + y * y + z * z).sqrt()
}

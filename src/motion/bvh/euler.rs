//! Rotations as three angles about three different axes, in any order.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat};

use super::document::Axis;

/// Angles in degrees with `rotation = R_a(angles[0]) R_b(angles[1]) R_c(angles[2])` for three
/// different axes a, b, c.
///
/// Of the two solutions and their turns, the one nearest to `previous`, so that a channel does not
/// jump by 360 from a frame to the next. Without a previous frame the middle angle lies in [-90,
/// 90] and the others in [-180, 180]. Where the middle angle is +-90 and only the sum of the others
/// counts, the last keeps its previous value.
pub(super) fn euler_angles(
    rotation: DQuat,
    order: [Axis; 3],
    previous: Option<[f64; 3]>,
) -> [f64; 3] {
    let [a, b, c] = order.map(Axis::index);
    let sign = if (a + 1) % 3 == b { 1.0 } else { -1.0 };
    let previous = previous.map(|angles| angles.map(f64::to_radians));
    let matrix = DMat3::from_quat(rotation);
    let at = |matrix: &DMat3, row: usize, column: usize| matrix.col(column)[row];
    // cos(middle), up to its sign.
    let flat = at(&matrix, a, a).hypot(at(&matrix, a, b));
    let last = if flat > 1e-9 {
        (-sign * at(&matrix, a, b)).atan2(at(&matrix, a, a))
    } else {
        previous.map_or(0.0, |angles| angles[2])
    };
    let middle = (sign * at(&matrix, a, c)).atan2(flat);
    // The first angle from what is left of the rotation without the last: an inaccurate last angle
    // near +-90 is made up for.
    let rest = DMat3::from_quat(rotation * DQuat::from_axis_angle(glam::DVec3::AXES[c], -last));
    let first = (sign * at(&rest, c, b)).atan2(at(&rest, b, b));
    let solutions = [[first, middle, last], [first + PI, PI - middle, last + PI]];
    let nearest = match previous {
        None => solutions[0],
        Some(previous) => {
            let turned = solutions.map(|angles| nearest_turn(angles, previous));
            let distance = |angles: &[f64; 3]| -> f64 {
                angles
                    .iter()
                    .zip(previous)
                    .map(|(angle, old)| (angle - old).abs())
                    .sum()
            };
            if distance(&turned[1]) < distance(&turned[0]) {
                turned[1]
            } else {
                turned[0]
            }
        }
    };
    nearest.map(f64::to_degrees)
}

fn nearest_turn(angles: [f64; 3], previous: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|index| {
        angles[index] - ((angles[index] - previous[index]) / TAU).round() * TAU
    })
}

//! From the numbers of a frame back to the joints' places in the world.

use glam::{DQuat, DVec3};
use ndarray::{ArrayView1, s};

use super::JOINTS;
use super::features::{BODY_POSITIONS, FACING, ROOT_POSITION};

/// The first three numbers of a row as a place or a velocity. Panics on fewer.
pub fn vector(row: ArrayView1<f64>) -> DVec3 {
    DVec3::new(row[0], row[1], row[2])
}

/// World positions of the 24 joints of a frame, cm: p^r for the root, `p^r + R_y(o^r) p^b` for the
/// others.
///
/// `frame`: the 149 numbers of a predicted frame or the 154 of a recorded one, not standardised.
/// Panics on fewer than 73 numbers.
pub fn world_positions(frame: ArrayView1<f64>) -> [DVec3; JOINTS] {
    let vector_at = |column: usize| vector(frame.slice(s![column..column + 3]));
    let root = vector_at(ROOT_POSITION.start);
    let facing = DQuat::from_rotation_y(frame[FACING.start]);
    std::array::from_fn(|joint| match joint {
        0 => root,
        _ => root + facing * vector_at(BODY_POSITIONS.start + 3 * (joint - 1)),
    })
}

//! From the numbers of a frame back to the joints' places in the world.

use glam::{DQuat, DVec3};
use ndarray::ArrayView1;

use super::JOINTS;
use super::features::{BODY_POSITIONS, FACING, ROOT_POSITION};

/// World positions of the 24 joints of a frame, cm: p^r for the root, `p^r + R_y(o^r) p^b` for the others.
///
/// `frame`: the 149 numbers of a predicted frame or the 154 of a recorded one, not standardised. Panics on fewer than 73 numbers.
pub fn world_positions(frame: ArrayView1<f64>) -> [DVec3; JOINTS] {
    let vector = |column: usize| DVec3::new(frame[column], frame[column + 1], frame[column + 2]);
    let root = vector(ROOT_POSITION.start);
    let facing = DQuat::from_rotation_y(frame[FACING.start]);
    std::array::from_fn(|joint| match joint {
        0 => root,
        _ => root + facing * vector(BODY_POSITIONS.start + 3 * (joint - 1)),
    })
}

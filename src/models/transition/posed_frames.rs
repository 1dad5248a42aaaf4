//! Predicted poses as the numbers of a frame: for networks whose outputs are joint rotations.

use glam::DVec3;
use ndarray::{Array2, ArrayView1, s};

use super::motion_rows::rows_from;
use crate::motion::facing::{FacingJoints, facing_angles_between};
use crate::motion::features::{CONTACTS, FACING, write_positions, write_velocities};
use crate::motion::placement::world_positions;

/// The 149 numbers of frames k1 + 1 .. k2, `[N, 149]`, not standardised.
///
/// `start` and `target`: features of the keyframes, of which o^r is read of k2 and all 149 numbers
/// of k1. `world`: world positions of the 24 joints in each predicted frame, `[N][24]`, cm.
/// `contacts`: labels, `[N, 4]`.
///
/// A frame's facing angle is that of its own joints, smoothed over time with standard deviation
/// `sigma` (frames) and joined to the keyframes' known angles, see [`facing_angles_between`]. The
/// recorded angles that p^b is turned by are smoothed over the whole clip. Where the predicted
/// poses are the recorded ones, p^b so comes within an LRP of 0.4, 1.3, 4.6, 3.4 and 2.3 cm of the
/// recorded p^b at N = 5, 10, 50, 100 and 150 (training clips of the dance data; 36 to 7 cm at N =
/// 10 to 150 if the window were smoothed by itself).
pub(crate) fn posed_frames(
    [start, target]: [ArrayView1<f64>; 2],
    world: &[Vec<DVec3>],
    contacts: &Array2<f64>,
    sigma: f64,
) -> Array2<f64> {
    let mut with_start = vec![world_positions(start).to_vec()];
    with_start.extend_from_slice(world);
    let ends = [start[FACING.start], target[FACING.start]];
    let facing = facing_angles_between(&with_start, &FacingJoints::DANCE, ends, sigma);
    let mut rows = rows_from(start, world.len());
    for row in 1..rows.nrows() {
        write_positions(&mut rows.row_mut(row), &with_start[row], facing[row]);
        rows.slice_mut(s![row, CONTACTS])
            .assign(&contacts.row(row - 1));
    }
    write_velocities(&mut rows);
    rows.slice(s![1.., ..]).to_owned()
}

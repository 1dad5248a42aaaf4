//! Rows of frames to be filled, and the contact labels that follow from their positions.

use ndarray::{Array2, s};

use crate::motion::contact::FOOT_JOINTS;
use crate::motion::features::{CONTACTS, FRAME};
use crate::motion::placement::world_positions;

/// Writes the contact labels of all rows but the first: 1 where the joint's squared speed in the
/// world is below `threshold`, (cm/frame)^2. `rows`: frames k1, k1 + 1, .., `[N + 1, 149]`.
pub(crate) fn write_contacts(rows: &mut Array2<f64>, threshold: f64) {
    for row in 1..rows.nrows() {
        let before = world_positions(rows.row(row - 1));
        let now = world_positions(rows.row(row));
        for (label, joint) in CONTACTS.zip(FOOT_JOINTS) {
            let planted = now[joint].distance_squared(before[joint]) < threshold;
            rows[[row, label]] = f64::from(planted);
        }
    }
}

/// Rows for keyframe k1 and the N frames after it, `[N + 1, 149]`; k1's numbers, of which `start`
/// has 149 or more, stand in the first, zeros in the others.
pub(crate) fn rows_from(start: ndarray::ArrayView1<f64>, length: usize) -> Array2<f64> {
    let mut rows = Array2::zeros((length + 1, FRAME));
    rows.row_mut(0).assign(&start.slice(s![..FRAME]));
    rows
}

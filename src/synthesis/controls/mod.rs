//! What a person changes about a sequence: where its root goes, when its keyframes stand, how fast
//! the parts of the body move.
//!
//! Every control is a method of [`SequenceRequest`] that takes a request and gives another, so they
//! combine in any order that makes sense: times first, then another trajectory, then turns, scales
//! and heights, then velocity factors.

mod asked;
mod csv;
mod curve;
mod gains;
mod points;
mod timing;
mod trajectory;
mod velocity;

pub use self::asked::{ControlError, Timing, TrajectoryControls, VelocityControls};
pub use self::csv::{TableError, read_trajectory, read_velocity_factors};
pub(crate) use curve::timed_curve;
pub use curve::{Speed, smooth_curve};
pub use gains::Gains;
pub use points::Points;

use glam::DVec3;
use ndarray::{Array2, ArrayView2};

#[cfg(doc)]
use super::SequenceRequest;

/// The row at a time between rows, by a Catmull-Rom spline through all of them with equal steps;
/// the ends are held.
fn row_at(rows: ArrayView2<f64>, time: f64) -> Vec<f64> {
    let last = rows.nrows() - 1;
    let before = (time.max(0.0) as usize).min(last);
    let share = (time - before as f64).clamp(0.0, 1.0);
    let at = |step: isize| rows.row((before as isize + step).clamp(0, last as isize) as usize);
    let (a, b, c, d) = (at(-1), at(0), at(1), at(2));
    let spline = |column: usize| {
        let (a, b, c, d) = (a[column], b[column], c[column], d[column]);
        let (square, cube) = (share * share, share * share * share);
        0.5 * (2.0 * b
            + (c - a) * share
            + (2.0 * a - 5.0 * b + 4.0 * c - d) * square
            + (3.0 * (b - c) + d - a) * cube)
    };
    (0..rows.ncols()).map(spline).collect()
}

/// Points as rows, `[points, 3]`.
pub(crate) fn rows_of(points: &[DVec3]) -> Array2<f64> {
    Array2::from_shape_fn((points.len(), 3), |(row, axis)| points[row][axis])
}

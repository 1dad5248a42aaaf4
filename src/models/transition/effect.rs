//! What a control does to a generated motion: the paper's section 4.1 in numbers.

use ndarray::{ArrayView1, ArrayView2, s};

use crate::motion::features::{BODY_POSITIONS, ROOT_POSITION};
use crate::motion::{PARTS, measured_velocity_factors};

/// A model follows a control where it gives at least this share of the change that is asked for.
pub const FOLLOWED: f64 = 1.0 / 3.0;

/// A change that was asked for and what came of it, in the unit of what is changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    pub asked: f64,
    /// In the direction asked for: below 0 the model went the other way.
    pub measured: f64,
}

impl Response {
    /// The share of the change that was given; NaN where none was asked for.
    pub fn share(self) -> f64 {
        self.measured / self.asked
    }

    /// Whether the share is at least [`FOLLOWED`].
    pub fn follows(self) -> bool {
        self.share() >= FOLLOWED
    }

    /// Mean change asked for and mean change measured.
    pub fn mean(responses: impl IntoIterator<Item = Self>) -> Self {
        let (mut sum, mut count) = ([0.0; 2], 0.0);
        for Self { asked, measured } in responses {
            // Asked-for changes may have either sign; what counts is how far the answer goes their
            // way.
            sum[0] += asked.abs();
            sum[1] += measured * asked.signum();
            count += 1.0;
        }
        Self {
            asked: sum[0] / count,
            measured: sum[1] / count,
        }
    }
}

/// How far the root goes along with a changed trajectory, cm.
///
/// Asked for: the mean distance between the two target trajectories, `[F, 3]`. Measured: the mean
/// over frames of the difference between the two generated motions' roots, in the direction of the
/// difference between the targets. `frames`: `[F, 149 or 154]`.
pub fn root_response(
    changed: (ArrayView2<f64>, ArrayView2<f64>),
    plain: (ArrayView2<f64>, ArrayView2<f64>),
) -> Response {
    let ((target, frames), (plain_target, plain_frames)) = (changed, plain);
    let roots = frames.slice(s![.., ROOT_POSITION]);
    let plain_roots = plain_frames.slice(s![.., ROOT_POSITION]);
    let count = target.nrows() as f64;
    let (mut asked, mut measured) = (0.0, 0.0);
    for row in 0..target.nrows() {
        let wanted = &target.row(row) - &plain_target.row(row);
        let distance = wanted.dot(&wanted).sqrt();
        if distance > 0.0 {
            let moved = &roots.row(row) - &plain_roots.row(row);
            asked += distance / count;
            measured += moved.dot(&wanted) / distance / count;
        }
    }
    Response { asked, measured }
}

/// Mean distance between the joints of two motions relative to the root (p^b of 23 joints), cm,
/// over their generated frames.
///
/// Frame k of N is compared with the frame at the same share of the other motion's length. Row 0 of
/// each is the keyframe and does not count.
pub fn body_distance(a: ArrayView2<f64>, b: ArrayView2<f64>) -> f64 {
    let (length, other) = (a.nrows() - 1, b.nrows() - 1);
    let of_frame = |frame: usize| {
        let same = (frame as f64 * other as f64 / length as f64).round() as usize;
        joint_distance(a.row(frame), b.row(same))
    };
    (1..=length).map(of_frame).sum::<f64>() / length as f64
}

/// Mean over the 23 joints of the distance between two frames' p^b, cm.
fn joint_distance(a: ArrayView1<f64>, b: ArrayView1<f64>) -> f64 {
    let joints = BODY_POSITIONS.step_by(3);
    let count = joints.len() as f64;
    let distance = |column: usize| {
        let square = |axis: usize| (a[column + axis] - b[column + axis]).powi(2);
        (0..3).map(square).sum::<f64>().sqrt()
    };
    joints.map(distance).sum::<f64>() / count
}

/// Mean over the generated frames of the velocity factors measured on positions, `[5]`, cm/frame.
/// Row 0 is the keyframe.
pub fn mean_velocity_factors(frames: ArrayView2<f64>) -> [f64; PARTS] {
    mean_rows(&measured_velocity_factors(frames)[1..])
}

/// Mean of rows of velocity factors, `[5]`, in their unit; NaN for no rows.
pub fn mean_rows(rows: &[[f64; PARTS]]) -> [f64; PARTS] {
    std::array::from_fn(|part| rows.iter().map(|row| row[part]).sum::<f64>() / rows.len() as f64)
}

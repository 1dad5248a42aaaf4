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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::features::FRAME;
    use ndarray::Array2;

    /// A motion whose joints all go along x by `body` and whose root goes along z by `root`,
    /// cm/frame.
    fn moving(frames: usize, body: f64, root: f64) -> Array2<f64> {
        Array2::from_shape_fn((frames, FRAME), |(frame, column)| {
            let time = frame as f64;
            if BODY_POSITIONS.contains(&column) && column % 3 == 0 {
                body * time
            } else if column == ROOT_POSITION.start + 2 {
                root * time
            } else {
                0.0
            }
        })
    }

    fn target(frames: usize, root: f64) -> Array2<f64> {
        moving(frames, 0.0, root)
            .slice(s![.., ROOT_POSITION])
            .to_owned()
    }

    #[test]
    fn a_root_that_goes_half_of_the_way_that_its_target_moved_follows_by_a_half() {
        let response = |root| {
            root_response(
                (target(11, 3.0).view(), moving(11, 0.0, root).view()),
                (target(11, 1.0).view(), moving(11, 0.0, 1.0).view()),
            )
        };
        let half = response(2.0);
        assert!((half.asked - 10.0).abs() < 1e-12 && (half.share() - 0.5).abs() < 1e-12);
        assert!(half.follows());
        assert!((response(0.0).share() + 0.5).abs() < 1e-12 && !response(0.0).follows());
        assert!(!response(1.6).follows());
    }

    #[test]
    fn responses_to_less_and_to_more_do_not_cancel() {
        let mean = Response::mean(
            [(-2.0, -1.0), (2.0, 1.0)].map(|(asked, measured)| Response { asked, measured }),
        );
        assert_eq!((mean.asked, mean.measured), (2.0, 1.0));
    }

    #[test]
    fn the_same_movement_in_twice_the_time_is_no_distance_and_half_the_factor() {
        let (slow, fast) = (moving(21, 1.0, 0.0), moving(11, 2.0, 0.0));
        assert!(body_distance(fast.view(), slow.view()) < 1e-12);
        let other = body_distance(moving(11, 3.0, 0.0).view(), fast.view());
        assert!((other - 5.5).abs() < 1e-12, "{other}");
        let factors = mean_velocity_factors(slow.view());
        assert!((factors[1] - 1.0).abs() < 1e-12, "{factors:?}");
        // The trunk's weights are 9, the root's 1 of them.
        assert!((factors[0] - 8.0 / 9.0).abs() < 1e-12, "{factors:?}");
    }
}

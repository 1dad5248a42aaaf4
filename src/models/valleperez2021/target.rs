//! What the flow models of the next frames (`target`, ours; spec, section 11):
//! y_n = (x_n - base_n) / r, base_n a function of the frames before n. The Jacobian is triangular:
//! log p(x) = log p(y) - N sum ln r.

use nalgebra::{Cholesky, DMatrix};
use ndarray::{Array1, Array2, ArrayView1, ArrayView2, s};

use super::config::TargetKind;

/// Frames that the linear base looks back on.
pub const LOOK_BACK: usize = 3;
/// Weight of the ridge regression.
const RIDGE: f64 = 1.0;
/// Least deviation of a channel that is divided by.
const LEAST_DEVIATION: f64 = 1e-4;
/// What is added to the diagonal of the residuals' correlation before it is inverted.
const JITTER: f64 = 1e-3;

/// base_n and r.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// base_n = matrix^T (x_n-1, x_n-2, x_n-3, 1), `[3 D + 1, D]`.
    matrix: Array2<f64>,
    /// r, `[D]`.
    deviation: Array1<f64>,
}

impl Target {
    /// # Errors
    /// Numbers of other shapes, or a deviation that is not above 0; the reason.
    pub fn from_parts(matrix: Array2<f64>, deviation: Array1<f64>) -> Result<Self, String> {
        let d = deviation.len();
        if matrix.dim() != (LOOK_BACK * d + 1, d) {
            return Err(format!("a base {:?} for {d} channels", matrix.dim()));
        }
        match deviation.iter().all(|&r| r > 0.0) {
            true => Ok(Self { matrix, deviation }),
            false => Err("a deviation that is not above 0".into()),
        }
    }

    /// Fitted once on the standardised pieces `[frames, D]` of the training part.
    pub fn fitted(kind: TargetKind, pieces: &[ArrayView2<'_, f32>]) -> Self {
        let d = pieces.first().map_or(0, ArrayView2::ncols);
        let mut matrix = Array2::zeros((LOOK_BACK * d + 1, d));
        match kind {
            TargetKind::Pose => return Self::pose(d),
            TargetKind::Difference => matrix.slice_mut(s![..d, ..]).diag_mut().fill(1.0),
            TargetKind::Linear => matrix = regression(pieces, d),
        }
        let mut target = Self {
            matrix,
            deviation: Array1::ones(d),
        };
        let (mut sum, mut count) = (Array1::<f64>::zeros(d), 0usize);
        target.each_residual(pieces, |y| {
            sum += &y.mapv(|y| y * y);
            count += 1;
        });
        target.deviation = sum.mapv(|it| (it / count.max(1) as f64).sqrt().max(LEAST_DEVIATION));
        target
    }

    /// The frames themselves.
    pub fn pose(channels: usize) -> Self {
        Self {
            matrix: Array2::zeros((LOOK_BACK * channels + 1, channels)),
            deviation: Array1::ones(channels),
        }
    }

    pub fn matrix(&self) -> &Array2<f64> {
        &self.matrix
    }

    pub fn deviation(&self) -> &Array1<f64> {
        &self.deviation
    }

    /// Sum of ln r over the channels.
    pub fn log_deviations(&self) -> f64 {
        self.deviation.iter().map(|r| r.ln()).sum()
    }

    /// base_n after the frames `before`, the latest first, `[3][D]`.
    fn base(&self, before: [ArrayView1<'_, f64>; LOOK_BACK]) -> Array1<f64> {
        let d = self.deviation.len();
        let mut base = self.matrix.row(LOOK_BACK * d).to_owned();
        for (k, frame) in before.iter().enumerate() {
            base += &frame.dot(&self.matrix.slice(s![k * d..(k + 1) * d, ..]));
        }
        base
    }

    /// y_1 .. y_N of `frames [3 + N, D]`: those that are looked back on, then x_1 .. x_N.
    pub fn forward(&self, frames: ArrayView2<'_, f64>) -> Array2<f64> {
        let mut y = frames.slice(s![LOOK_BACK.., ..]).to_owned();
        for (n, mut y) in y.rows_mut().into_iter().enumerate() {
            let base = self.base([2, 1, 0].map(|k| frames.row(n + k)));
            y -= &base;
            y /= &self.deviation;
        }
        y
    }

    /// x_1 .. x_N of `y [N, D]` after `before [3, D]`, the latest last.
    pub fn inverse(&self, before: ArrayView2<'_, f64>, y: ArrayView2<'_, f64>) -> Array2<f64> {
        let (d, n) = (self.deviation.len(), y.nrows());
        let mut frames = Array2::zeros((LOOK_BACK + n, d));
        frames.slice_mut(s![..LOOK_BACK, ..]).assign(&before);
        for (n, y) in y.rows().into_iter().enumerate() {
            let base = self.base([2, 1, 0].map(|k| frames.row(n + k)));
            frames
                .row_mut(LOOK_BACK + n)
                .assign(&(base + &y * &self.deviation));
        }
        frames.slice_move(s![LOOK_BACK.., ..])
    }

    fn each_residual(
        &self,
        pieces: &[ArrayView2<'_, f32>],
        mut with: impl FnMut(ArrayView1<'_, f64>),
    ) {
        for piece in pieces {
            let frames = piece.mapv(f64::from);
            if frames.nrows() > LOOK_BACK {
                let y = self.forward(frames.view());
                y.rows().into_iter().for_each(&mut with);
            }
        }
    }

    /// The inverse Cholesky factor of the targets' correlation + 1e-3 I over the training part: what
    /// makes their channels independent, `[D, D]`.
    pub fn whitening(&self, pieces: &[ArrayView2<'_, f32>]) -> Array2<f64> {
        let d = self.deviation.len();
        let mut square = DMatrix::<f64>::zeros(d, d);
        let (mut mean, mut count) = (Array1::<f64>::zeros(d), 0usize);
        self.each_residual(pieces, |y| {
            mean += &y;
            count += 1;
            for j in 0..d {
                for i in j..d {
                    square[(i, j)] += y[i] * y[j];
                }
            }
        });
        let count = count.max(1) as f64;
        mean /= count;
        let covariance =
            |i: usize, j: usize| square[(i.max(j), i.min(j))] / count - mean[i] * mean[j];
        let deviation: Vec<f64> = (0..d).map(|i| covariance(i, i).max(0.0).sqrt()).collect();
        let correlation = DMatrix::from_fn(d, d, |i, j| {
            let product = deviation[i] * deviation[j];
            let shared = if i == j { JITTER } else { 0.0 };
            if product > 0.0 {
                covariance(i, j) / product + shared
            } else {
                f64::from(u8::from(i == j)) + shared
            }
        });
        let inverse = Cholesky::new(correlation).and_then(|it| it.l().try_inverse());
        match inverse {
            Some(inverse) => Array2::from_shape_fn((d, d), |(i, j)| inverse[(i, j)]),
            None => Array2::eye(d),
        }
    }
}

/// Ridge regression of each frame on the three before it and a constant, `[3 D + 1, D]`.
fn regression(pieces: &[ArrayView2<'_, f32>], d: usize) -> Array2<f64> {
    let n = LOOK_BACK * d + 1;
    let (mut normal, mut right) = (Array2::<f64>::zeros((n, n)), Array2::<f64>::zeros((n, d)));
    for piece in pieces {
        let frames = piece.mapv(f64::from);
        let Some(rows) = frames
            .nrows()
            .checked_sub(LOOK_BACK)
            .filter(|&rows| rows > 0)
        else {
            continue;
        };
        let mut known = Array2::ones((rows, n));
        for k in 0..LOOK_BACK {
            let from = LOOK_BACK - 1 - k;
            known
                .slice_mut(s![.., k * d..(k + 1) * d])
                .assign(&frames.slice(s![from..from + rows, ..]));
        }
        normal += &known.t().dot(&known);
        right += &known.t().dot(&frames.slice(s![LOOK_BACK.., ..]));
    }
    // The constant is not held back.
    normal
        .diag_mut()
        .slice_mut(s![..n - 1])
        .mapv_inplace(|x| x + RIDGE);
    let matrix = DMatrix::from_fn(n, n, |i, j| normal[[i, j]]);
    let right = DMatrix::from_fn(n, d, |i, j| right[[i, j]]);
    match Cholesky::new(matrix) {
        Some(factor) => {
            let solved = factor.solve(&right);
            Array2::from_shape_fn((n, d), |(i, j)| solved[(i, j)])
        }
        // Pieces that are too short for a single row.
        None => Array2::zeros((n, d)),
    }
}

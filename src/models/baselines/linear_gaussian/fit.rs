//! The next frames as a linear function of those before, and their Gaussian error.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use ndarray::{Array2, ArrayView2, s};

use super::settings::{Base, Covariance};
use crate::models::ModelError;
use crate::models::dance_features::Contexts;

/// Known frames that are looked at.
pub const LOOK_BACK: usize = 3;
/// Weight of the ridge regressions.
const RIDGE: f64 = 1.0;
/// What is added to variances, so that numbers that never vary have a density.
const JITTER: f64 = 1e-9;

/// Errors e = y - matrix^T (x_-1, x_-2, x_-3, 1), Gaussian of mean 0, where y is a frame or, where
/// several are told together, N of them.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// `[3 D + 1, D]` or `[3 D + 1, N D]`
    matrix: DMatrix<f64>,
    /// Lower factor of the covariance, of as many rows and columns.
    factor: DMatrix<f64>,
    /// Frames of y.
    together: usize,
}

/// (x_-1, x_-2, x_-3, 1) before row `at` of `frames [.., D]`.
fn known(frames: ArrayView2<'_, f64>, at: usize) -> DVector<f64> {
    let rows = (1..=LOOK_BACK).flat_map(|back| frames.row(at - back).to_vec());
    DVector::from_iterator(LOOK_BACK * frames.ncols() + 1, rows.chain([1.0]))
}

/// `together` rows of `frames` from `at` on, one after another.
fn asked(frames: ArrayView2<'_, f64>, at: usize, together: usize) -> DVector<f64> {
    let rows = frames.slice(s![at..at + together, ..]);
    DVector::from_iterator(rows.len(), rows.iter().copied())
}

impl Fitted {
    /// To the windows of standardised pieces `[frames, D]`.
    ///
    /// # Errors
    /// Too few frames.
    pub fn to(
        pieces: &[Array2<f64>],
        base: Base,
        covariance: Covariance,
        contexts: Contexts,
    ) -> Result<Self, ModelError> {
        let together = match base {
            Base::Zero | Base::OwnFrames => 1,
            Base::Mean | Base::LastFrame | Base::LastFrames => contexts.predicted,
        };
        let starts = |piece: &Array2<f64>| contexts.starts(piece.nrows());
        let pairs = || {
            pieces.iter().flat_map(move |piece| {
                starts(piece)
                    .map(move |at| (known(piece.view(), at), asked(piece.view(), at, together)))
            })
        };
        let count = pieces
            .iter()
            .map(|piece| starts(piece).len())
            .sum::<usize>();
        let d = pieces.first().map_or(0, Array2::ncols);
        if count == 0 || d == 0 {
            let longest = pieces.iter().map(Array2::nrows).max().unwrap_or(0);
            return Err(ModelError::Data {
                reason: format!(
                    "no training clip has the {} frames of a window, the longest has {longest}; \
                     give longer clips, or shorter model.motion_context and model.audio_past",
                    contexts.past() + contexts.future()
                ),
            });
        }
        let (inputs, outputs) = (LOOK_BACK * d + 1, together * d);
        let mut matrix = DMatrix::zeros(inputs, outputs);
        match base {
            Base::Zero => {}
            Base::Mean => {
                let sum = pairs().fold(DVector::zeros(outputs), |sum, (_, y)| sum + y);
                matrix.set_row(inputs - 1, &(sum / count as f64).transpose());
            }
            Base::LastFrame => {
                for n in 0..together {
                    matrix.view_mut((0, n * d), (d, d)).fill_with_identity();
                }
            }
            Base::LastFrames | Base::OwnFrames => matrix = regression(pairs(), inputs, outputs)?,
        }
        let mut spread = DMatrix::zeros(outputs, outputs);
        match covariance {
            Covariance::Unit => spread.fill_with_identity(),
            Covariance::Diagonal | Covariance::Full => {
                let mut mean = DVector::zeros(outputs);
                for (x, y) in pairs() {
                    let error = y - matrix.tr_mul(&x);
                    spread.ger(1.0, &error, &error, 1.0);
                    mean += error;
                }
                mean /= count as f64;
                spread /= count as f64;
                spread.ger(-1.0, &mean, &mean, 1.0);
                // Errors are told about their mean, which only that of a pose held is not 0.
                let mut constant = matrix.row_mut(inputs - 1);
                constant += mean.transpose();
                for k in 0..outputs {
                    spread[(k, k)] = spread[(k, k)].max(0.0) + JITTER;
                }
                if covariance == Covariance::Diagonal {
                    spread = DMatrix::from_diagonal(&spread.diagonal());
                }
            }
        }
        let factor = Cholesky::new(spread).map(Cholesky::<f64, Dyn>::unpack);
        let factor = factor.ok_or_else(|| ModelError::Data {
            reason: "the errors of a linear prediction have no density: there are fewer training \
                     frames than numbers to predict"
                .into(),
        })?;
        Ok(Self {
            matrix,
            factor,
            together,
        })
    }

    /// ln p of the rows of `frames [3 + N, D]` behind the three that are looked at.
    pub fn log_density(&self, frames: ArrayView2<'_, f64>) -> f64 {
        let numbers = self.matrix.ncols() as f64;
        let scale: f64 = self.factor.diagonal().iter().map(|x| x.ln()).sum();
        let starts =
            (LOOK_BACK..(frames.nrows() + 1).saturating_sub(self.together)).step_by(self.together);
        let density = |at| {
            let error = asked(frames, at, self.together) - self.matrix.tr_mul(&known(frames, at));
            let z = self.factor.solve_lower_triangular(&error);
            let squares = z.map_or(f64::INFINITY, |z| z.norm_squared());
            -0.5 * (squares + numbers * std::f64::consts::TAU.ln()) - scale
        };
        starts.map(density).sum()
    }

    /// The frame behind `frames [3, D]` for independent draws, [`Fitted::draws`] of them.
    pub fn sample(&self, frames: ArrayView2<'_, f64>, draws: &[f64]) -> Vec<f64> {
        let mean = self.matrix.tr_mul(&known(frames, LOOK_BACK));
        let drawn = &self.factor * DVector::from_column_slice(draws);
        let next = mean + drawn;
        next.iter().take(frames.ncols()).copied().collect()
    }

    /// Numbers that are drawn for a frame.
    pub fn draws(&self) -> usize {
        self.matrix.ncols()
    }
}

/// Ridge regression; the constant, the last of the inputs, is not held back.
fn regression(
    pairs: impl Iterator<Item = (DVector<f64>, DVector<f64>)>,
    inputs: usize,
    outputs: usize,
) -> Result<DMatrix<f64>, ModelError> {
    let (mut normal, mut right) = (
        DMatrix::zeros(inputs, inputs),
        DMatrix::zeros(inputs, outputs),
    );
    for (x, y) in pairs {
        normal.ger(1.0, &x, &x, 1.0);
        right.ger(1.0, &x, &y, 1.0);
    }
    for k in 0..inputs - 1 {
        normal[(k, k)] += RIDGE;
    }
    let factor = Cholesky::new(normal).ok_or_else(|| ModelError::Data {
        reason: "the training frames do not tell a linear prediction".into(),
    })?;
    Ok(factor.solve(&right))
}

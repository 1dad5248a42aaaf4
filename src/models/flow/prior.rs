//! The standard normal density that a flow ends in, and the likelihood that follows from it (spec of
//! Valle-Pérez et al., section 6).

use ndarray::Array2;
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::{LossTerms, Watched};

/// ln 2 pi.
pub const LN_TAU: f64 = 1.837_877_066_409_345_3;

/// Sum of the squares of every window's numbers, `values` in windows of `numbers`, f64.
pub fn squares_of_windows<T: Real>(values: &[T], numbers: usize) -> Vec<f64> {
    let square = |&x: &T| Real::to_f64(x).powi(2);
    let windows = values.chunks_exact(numbers.max(1));
    windows
        .map(|window| window.iter().map(square).sum())
        .collect()
}

/// Draws from a normal distribution of deviation `temperature`, `[rows, columns]`.
pub fn noise_like(
    rng: &mut impl Rng,
    (rows, columns): (usize, usize),
    temperature: f64,
) -> Array2<f64> {
    Array2::from_shape_simple_fn((rows, columns), || {
        let draw: f64 = StandardNormal.sample(rng);
        temperature * draw
    })
}

/// The least of some numbers.
pub(super) fn least<T: Real>(values: &[T]) -> f64 {
    let values = values.iter().map(|&x| Real::to_f64(x));
    values.fold(f64::INFINITY, f64::min)
}

/// A block of a flow whose logarithms are this small hardly lets a channel through.
const LEAST_LOG: f64 = -7.0;
const ADVICE: &str = "a block of the flow all but loses a channel; try a lower \
                      optimiser.learning_rate or fewer model.blocks";

/// What a flow makes of rows of D channels, as far as its likelihood follows from it.
pub struct Density<'f> {
    /// z, `[rows, D]`.
    pub z: Var,
    /// ln |det| of all norms for one row, `[1]`.
    pub norms: Var,
    /// Of all linear layers for one row, `[1]`.
    pub linears: Var,
    /// Scales of the couplings: their logarithms add up to the couplings' ln |det|.
    pub scales: &'f [Var],
    /// The least logarithm of a factor in the norms, and in the linear layers.
    pub least: [f64; 2],
}

impl Density<'_> {
    /// -log p of all rows times `unit`, as `prior`, `norm`, `linear` and `coupling`.
    ///
    /// # Errors
    /// z is no matrix.
    pub fn loss<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        unit: f64,
    ) -> Result<LossTerms, AutogradError> {
        let numbers = tape.values(self.z).len() as f64;
        let rows = tape.shape(self.z).first().copied().unwrap_or(0) as f64;
        let squares = tape.square(self.z);
        let squares = tape.sum(squares);
        let prior = tape.affine(squares, unit / 2.0, LN_TAU / 2.0 * numbers * unit);
        let norms = tape.affine(self.norms, -rows * unit, 0.0);
        let linears = tape.affine(self.linears, -rows * unit, 0.0);
        let mut couplings = tape.constant_with(&[1], |out| out.fill(T::zero()));
        let mut least_scale = f64::INFINITY;
        for &scale in self.scales {
            least_scale = least_scale.min(least(tape.values(scale)));
            let logs = tape.ln(scale);
            let sum = tape.sum(logs);
            let nats = tape.affine(sum, -unit, 0.0);
            couplings = tape.add(couplings, nats)?;
        }
        let terms = [
            ("prior", 1.0, prior),
            ("norm", 1.0, norms),
            ("linear", 1.0, linears),
            ("coupling", 1.0, couplings),
        ];
        let mut losses = LossTerms::weighted(tape, &terms, None)?;
        let [norm, linear] = self.least;
        let watched = [
            ("log_norm", norm),
            ("log_s", linear),
            ("log_scale", least_scale.ln()),
        ];
        let watched = watched.map(|(name, least)| Watched {
            name,
            least,
            bound: LEAST_LOG,
            advice: ADVICE,
        });
        losses.watched = watched.to_vec();
        Ok(losses)
    }
}

//! The standard normal density that a flow ends in.

use ndarray::Array2;
use rand::Rng;
use rand_distr::{Distribution as _, StandardNormal};

use crate::autograd::Real;

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

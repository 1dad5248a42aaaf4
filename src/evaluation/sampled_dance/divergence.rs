//! Dances that leave all that was danced in training.

use ndarray::ArrayView2;

/// Standard deviations from the mean beyond which nothing is a dance.
const BOUND: f64 = 10.0;

/// The first frame and its first column in which a dance, standardised by the training part,
/// `[frames, columns]`, lies beyond 10 deviations or is not a number; none of a dance that stays
/// within.
#[must_use]
pub fn leaves(standardised: ArrayView2<'_, f64>) -> Option<(usize, usize)> {
    let mut numbers = standardised.indexed_iter();
    let beyond = numbers.find(|(_, number)| number.is_nan() || number.abs() > BOUND);
    beyond.map(|(place, _)| place)
}

//! How far dances go from frame to frame: a model that trembles goes further than the data.

use ndarray::{ArrayView2, s};

/// Mean |x_t - x_(t-1)| over all columns and frames of all dances, in standard deviations.
///
/// `standardised`: by the training part, `[frames, columns]` each. None where no dance has two
/// frames.
#[must_use]
pub fn mean_step(standardised: &[ArrayView2<'_, f64>]) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for dance in standardised.iter().filter(|dance| dance.nrows() > 1) {
        let steps = &dance.slice(s![1.., ..]) - &dance.slice(s![..-1, ..]);
        sum += steps.iter().map(|step| step.abs()).sum::<f64>();
        count += steps.len();
    }
    (count > 0).then(|| sum / count as f64)
}

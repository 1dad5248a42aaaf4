//! Means and deviations of columns over the training part.

use ndarray::{Array, Array1, Array2, ArrayView2, Axis, Dimension};

/// Mean and deviation of every column, as a weights file holds them.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// `[columns]`, each in its column's unit.
    pub mean: Array1<f64>,
    /// `[columns]`, never 0.
    pub deviation: Array1<f64>,
}

impl Scale {
    /// Over all frames of pieces `[frames, columns]`, with deviations of at least `floors`
    /// `[columns]`.
    pub fn of(pieces: &[Array2<f64>], floors: &[f64]) -> Self {
        let count = pieces.iter().map(Array2::nrows).sum::<usize>().max(1) as f64;
        let mut mean = Array1::zeros(floors.len());
        pieces
            .iter()
            .for_each(|piece| mean += &piece.sum_axis(Axis(0)));
        mean /= count;
        let mut variance = Array1::<f64>::zeros(floors.len());
        for row in pieces.iter().flat_map(|piece| piece.rows()) {
            variance
                .iter_mut()
                .zip(row)
                .zip(&mean)
                .for_each(|((sum, x), mean)| {
                    *sum += (x - mean).powi(2);
                });
        }
        let deviations = variance.iter().zip(floors);
        let deviations = deviations.map(|(sum, &floor)| (sum / count).sqrt().max(floor));
        Self {
            deviation: rounded(deviations.collect()),
            mean: rounded(mean),
        }
    }

    /// `(x - mean) / deviation` of `[frames, columns]`.
    pub fn standardise(&self, columns: ArrayView2<f64>) -> Array2<f32> {
        let standardised = (&columns - &self.mean) / &self.deviation;
        standardised.mapv(|x| x as f32)
    }

    /// Back to the columns' units.
    pub fn restore(&self, standardised: ArrayView2<f32>) -> Array2<f64> {
        standardised.mapv(f64::from) * &self.deviation + &self.mean
    }

    /// Sum of the deviations' binary logarithms: what a likelihood of standardised numbers lacks to
    /// one in the columns' units, bits a frame.
    pub fn bits(&self) -> f64 {
        self.deviation
            .iter()
            .map(|deviation| deviation.log2())
            .sum()
    }
}

/// Numbers that a weights file holds exactly, in f32.
pub(super) fn rounded<D: Dimension>(numbers: Array<f64, D>) -> Array<f64, D> {
    numbers.mapv(|x| f64::from(x as f32))
}

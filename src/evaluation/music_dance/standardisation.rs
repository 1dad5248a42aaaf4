//! Features in units of the real windows' deviations.

use ndarray::{Array1, Array2, ArrayView2, Axis};

/// A column whose standard deviation is below this has nothing to be measured in.
const LEAST_DEVIATION: f64 = 1e-6;

/// Mean and standard deviation of each feature over the real windows, by which those of all others
/// are standardised.
#[derive(Debug, Clone, PartialEq)]
pub struct Standardisation {
    /// Those of the features that vary.
    columns: Vec<usize>,
    mean: Array1<f64>,
    deviation: Array1<f64>,
}

impl Standardisation {
    /// That of features, `[windows, features]`: population standard deviations; columns whose one
    /// is below 1e-6 are dropped. None of no window.
    #[must_use]
    pub fn of(features: ArrayView2<'_, f64>) -> Option<Self> {
        let mean = features.mean_axis(Axis(0))?;
        let deviation = features.std_axis(Axis(0), 0.0);
        let columns = deviation.iter().enumerate();
        let columns = columns.filter(|(_, deviation)| **deviation >= LEAST_DEVIATION);
        let columns: Vec<usize> = columns.map(|(column, _)| column).collect();
        Some(Self {
            mean: mean.select(Axis(0), &columns),
            deviation: deviation.select(Axis(0), &columns),
            columns,
        })
    }

    /// The features that vary, standardised, `[windows, kept features]`.
    ///
    /// # Panics
    /// `features` has fewer columns than those that this was taken from.
    #[must_use]
    pub fn apply(&self, features: ArrayView2<'_, f64>) -> Array2<f64> {
        let kept = features.select(Axis(1), &self.columns);
        (kept - &self.mean) / &self.deviation
    }
}

#[cfg(test)]
mod tests {
    use ndarray::{Array2, array};

    use super::Standardisation;

    #[test]
    fn columns_that_do_not_vary_are_dropped() {
        let features = array![[1.0, 5.0, 2.0], [3.0, 5.0, 2.0], [5.0, 5.0, 2.0 + 1e-7]];
        let standard = Standardisation::of(features.view()).unwrap();
        let standardised = standard.apply(features.view());
        let sigma = (8.0f64 / 3.0).sqrt();
        assert_eq!(standardised.dim(), (3, 1));
        for (found, expected) in standardised.iter().zip([-2.0, 0.0, 2.0]) {
            assert!((found - expected / sigma).abs() < 1e-12);
        }
        assert_eq!(Standardisation::of(Array2::zeros((0, 3)).view()), None);
    }
}

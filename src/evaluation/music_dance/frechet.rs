//! How far two sets of features lie apart, and how wide one is spread.

use nalgebra::{DMatrix, SymmetricEigen};
use ndarray::{Array1, Array2, ArrayView2, Axis};

/// A column whose standard deviation is below this has nothing to be measured in.
const LEAST_DEVIATION: f64 = 1e-6;
/// Steps after which no eigenvalues are expected any more.
const MOST_STEPS: usize = 10_000;

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

/// Frechet distance of the normal distributions of two sets of features (FID), `[windows,
/// features]` each: |m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)), covariances with n - 1.
///
/// By symmetric eigenvalues: tr (S1 S2)^(1/2) is the sum of the roots of those of S1^(1/2) S2
/// S1^(1/2), negative ones of rounding taken as 0. None of fewer than two windows or other numbers
/// of features, and where a number is not finite.
#[must_use]
pub fn frechet_distance(a: ArrayView2<'_, f64>, b: ArrayView2<'_, f64>) -> Option<f64> {
    let is_finite = a.iter().chain(&b).all(|x| x.is_finite());
    if a.nrows() < 2 || b.nrows() < 2 || a.ncols() != b.ncols() || !is_finite {
        return None;
    }
    if a.ncols() == 0 {
        return Some(0.0);
    }
    let means = a.mean_axis(Axis(0))? - b.mean_axis(Axis(0))?;
    let (first, second) = (covariance(a)?, covariance(b)?);
    let traces = first.trace() + second.trace();
    let SymmetricEigen {
        eigenvectors,
        mut eigenvalues,
    } = eigen(first)?;
    eigenvalues.apply(|value| *value = value.max(0.0).sqrt());
    let root = &eigenvectors * DMatrix::from_diagonal(&eigenvalues) * eigenvectors.transpose();
    let product = &root * second * &root;
    // Rounding alone makes it unequal to its transpose.
    let product = (&product + product.transpose()) * 0.5;
    let roots = eigen(product)?.eigenvalues;
    let shared: f64 = roots.iter().map(|value| value.max(0.0).sqrt()).sum();
    Some((means.dot(&means) + traces - 2.0 * shared).max(0.0))
}

fn eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, nalgebra::Dyn>> {
    SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_STEPS)
}

/// With n - 1, `[features, features]`.
fn covariance(features: ArrayView2<'_, f64>) -> Option<DMatrix<f64>> {
    let centred = &features - &features.mean_axis(Axis(0))?;
    let covariance = centred.t().dot(&centred) / (features.nrows() as f64 - 1.0);
    let (rows, columns) = covariance.dim();
    Some(DMatrix::from_fn(rows, columns, |row, column| {
        covariance[[row, column]]
    }))
}

/// Diversity: mean Euclidean distance of two windows' features, over all pairs, `[windows,
/// features]`. None of fewer than two.
#[must_use]
pub fn diversity(features: ArrayView2<'_, f64>) -> Option<f64> {
    let windows = features.nrows();
    let pairs = (0..windows).flat_map(|a| (0..a).map(move |b| (a, b)));
    let distance = |(a, b): (usize, usize)| {
        let difference = &features.row(a) - &features.row(b);
        difference.dot(&difference).sqrt()
    };
    let sum: f64 = pairs.map(distance).sum();
    (windows > 1).then(|| 2.0 * sum / (windows * (windows - 1)) as f64)
}

#[cfg(test)]
mod tests {
    use ndarray::{Array2, array};

    use super::{Standardisation, diversity, frechet_distance};

    fn waves(windows: usize, features: usize, speed: f64) -> Array2<f64> {
        Array2::from_shape_fn((windows, features), |(n, k)| {
            (speed * (n * n) as f64 * (k as f64 + 1.3)).sin() + 0.1 * k as f64
        })
    }

    #[test]
    fn a_set_is_no_way_from_itself_even_with_fewer_windows_than_features() {
        for windows in [2, 5, 60] {
            let features = waves(windows, 12, 0.31);
            assert!(frechet_distance(features.view(), features.view()).unwrap() < 1e-6);
        }
    }

    #[test]
    fn a_shift_counts_squared_and_a_scale_by_the_difference_of_deviations() {
        let features = waves(40, 6, 0.17);
        let shifted = &features + 2.0;
        let distance = frechet_distance(features.view(), shifted.view()).unwrap();
        assert!((distance - 24.0).abs() < 1e-6);
        // Of commuting covariances the rest is the sum of (sigma1 - sigma2)^2.
        let wider = &features * 3.0 - &(features.mean_axis(ndarray::Axis(0)).unwrap() * 2.0);
        let expected: f64 = features
            .var_axis(ndarray::Axis(0), 1.0)
            .iter()
            .map(|v| 4.0 * v)
            .sum();
        let distance = frechet_distance(features.view(), wider.view()).unwrap();
        assert!((distance - expected).abs() < 1e-6, "{distance} {expected}");
        let back = frechet_distance(wider.view(), features.view()).unwrap();
        assert!((distance - back).abs() < 1e-6);
    }

    #[test]
    fn two_features_agree_with_the_closed_form() {
        // tr sqrt(M) of 2 x 2 is sqrt(tr M + 2 sqrt(det M)).
        let (a, b) = (waves(30, 2, 0.23), waves(25, 2, 0.71) * 1.7);
        let covariance = |x: &Array2<f64>| {
            let centred = x - &x.mean_axis(ndarray::Axis(0)).unwrap();
            centred.t().dot(&centred) / (x.nrows() as f64 - 1.0)
        };
        let (s1, s2) = (covariance(&a), covariance(&b));
        let m = s1.dot(&s2);
        let det = m[[0, 0]] * m[[1, 1]] - m[[0, 1]] * m[[1, 0]];
        let shared = (m[[0, 0]] + m[[1, 1]] + 2.0 * det.sqrt()).sqrt();
        let mean = |x: &Array2<f64>| x.mean_axis(ndarray::Axis(0)).unwrap();
        let apart = mean(&a) - mean(&b);
        let traces: f64 = (0..2).map(|k| s1[[k, k]] + s2[[k, k]]).sum();
        let expected = apart.dot(&apart) + traces - 2.0 * shared;
        let distance = frechet_distance(a.view(), b.view()).unwrap();
        assert!((distance - expected).abs() < 1e-9, "{distance} {expected}");
    }

    #[test]
    fn what_has_no_distance_has_none() {
        let one = waves(1, 3, 0.1);
        let some = waves(5, 3, 0.1);
        assert_eq!(frechet_distance(one.view(), some.view()), None);
        assert_eq!(frechet_distance(some.view(), waves(5, 2, 0.1).view()), None);
        let endless = &some * f64::INFINITY;
        assert_eq!(frechet_distance(endless.view(), some.view()), None);
        assert_eq!(diversity(one.view()), None);
    }

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

    #[test]
    fn diversity_is_a_mean_over_pairs() {
        let features = array![[0.0, 0.0], [3.0, 4.0], [0.0, 8.0]];
        let expected = (5.0 + 8.0 + 5.0) / 3.0;
        assert!((diversity(features.view()).unwrap() - expected).abs() < 1e-12);
    }
}

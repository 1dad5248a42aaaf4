//! How far two sets of vectors lie apart, by their first two moments.

use nalgebra::{DMatrix, SVD, SymmetricEigen};
use ndarray::{Array1, ArrayView2, Axis};

/// Steps after which no eigenvalues are expected any more.
const MOST_STEPS: usize = 10_000;

/// Mean and second moment S of a set of vectors.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    mean: Array1<f64>,
    trace: f64,
    /// F with F^T F = S, `[numbers, numbers]`.
    factor: DMatrix<f64>,
}

impl Moments {
    /// Mean and covariance with n - 1 of `[vectors, numbers]`. None of fewer than two, and where a
    /// number is not finite.
    #[must_use]
    pub fn of(vectors: ArrayView2<'_, f64>) -> Option<Self> {
        if vectors.nrows() < 2 || !is_finite(vectors) {
            return None;
        }
        Self::with(vectors, covariance(vectors)?)
    }

    /// Mean and, in the covariance's place, the mean of x x^T about the origin, of `[vectors,
    /// numbers]`. None of none, and where a number is not finite.
    #[must_use]
    pub fn about_origin(vectors: ArrayView2<'_, f64>) -> Option<Self> {
        if vectors.is_empty() || !is_finite(vectors) {
            return None;
        }
        Self::with(vectors, products(vectors, vectors.nrows() as f64))
    }

    fn with(vectors: ArrayView2<'_, f64>, second: DMatrix<f64>) -> Option<Self> {
        let (mean, trace) = (vectors.mean_axis(Axis(0))?, second.trace());
        if mean.is_empty() {
            return None;
        }
        let SymmetricEigen {
            eigenvectors,
            mut eigenvalues,
        } = eigen(second)?;
        eigenvalues.apply(|value| *value = value.max(0.0).sqrt());
        let factor = DMatrix::from_diagonal(&eigenvalues) * eigenvectors.transpose();
        Some(Self {
            mean,
            trace,
            factor,
        })
    }

    /// Frechet distance |m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)), a squared length; of the
    /// normal distributions where S is a covariance.
    ///
    /// The roots of the eigenvalues of S1^(1/2) S2 S1^(1/2) are the singular values of F1 F2^T,
    /// which are told without squaring: the roots of small eigenvalues would be rounding of the
    /// large ones. None of other numbers of numbers.
    #[must_use]
    pub fn distance(&self, other: &Self) -> Option<f64> {
        if self.mean.len() != other.mean.len() {
            return None;
        }
        let means = &self.mean - &other.mean;
        let product = &self.factor * other.factor.transpose();
        let svd = SVD::try_new(product, false, false, f64::EPSILON, MOST_STEPS)?;
        let shared = svd.singular_values.sum();
        Some((means.dot(&means) + self.trace + other.trace - 2.0 * shared).max(0.0))
    }
}

/// Frechet distance of the normal distributions of two sets of standardised features (FID),
/// `[windows, features]` each: |m1 - m2|^2 + tr(S1 + S2 - 2 (S1 S2)^(1/2)), covariances with n - 1.
///
/// By symmetric eigenvalues: tr (S1 S2)^(1/2) is the sum of the roots of those of S1^(1/2) S2
/// S1^(1/2), negative ones of rounding taken as 0. None of fewer than two windows or other numbers
/// of features, and where a number is not finite. Of numbers of several units, some of them far
/// larger than others, [`Moments`] loses fewer digits.
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

fn is_finite(vectors: ArrayView2<'_, f64>) -> bool {
    vectors.iter().all(|x| x.is_finite())
}

fn eigen(matrix: DMatrix<f64>) -> Option<SymmetricEigen<f64, nalgebra::Dyn>> {
    SymmetricEigen::try_new(matrix, f64::EPSILON, MOST_STEPS)
}

/// With n - 1, `[numbers, numbers]`.
fn covariance(vectors: ArrayView2<'_, f64>) -> Option<DMatrix<f64>> {
    let centred = &vectors - &vectors.mean_axis(Axis(0))?;
    Some(products(centred.view(), vectors.nrows() as f64 - 1.0))
}

/// Sum of x x^T over `[vectors, numbers]`, divided by `count`.
fn products(vectors: ArrayView2<'_, f64>, count: f64) -> DMatrix<f64> {
    let products = vectors.t().dot(&vectors) / count;
    let (rows, columns) = products.dim();
    DMatrix::from_fn(rows, columns, |row, column| products[[row, column]])
}

#[cfg(test)]
mod tests {
    use ndarray::{Array2, array};

    use super::{Moments, frechet_distance};

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
        assert_eq!(Moments::about_origin(endless.view()), None);
        assert_eq!(Moments::about_origin(Array2::zeros((0, 3)).view()), None);
    }

    #[test]
    fn moments_give_the_distance_of_normal_distributions() {
        for (windows, features) in [(40, 6), (5, 12)] {
            let (a, b) = (
                waves(windows, features, 0.23),
                waves(30, features, 0.71) * 1.7,
            );
            let [first, second] = [&a, &b].map(|set| Moments::of(set.view()).unwrap());
            let expected = frechet_distance(a.view(), b.view()).unwrap();
            let distance = first.distance(&second).unwrap();
            assert!((distance - expected).abs() < 1e-6, "{distance} {expected}");
            assert!(first.distance(&first).unwrap() < 1e-12);
        }
    }

    #[test]
    fn about_the_origin_means_count_in_both_moments() {
        // One number: second moments 5 and 10, means 2 and 3.
        let (a, b) = (array![[1.0], [3.0]], array![[2.0], [4.0]]);
        let [a, b] = [a, b].map(|set| Moments::about_origin(set.view()).unwrap());
        let expected = 1.0 + 5.0 + 10.0 - 2.0 * 50f64.sqrt();
        assert!((a.distance(&b).unwrap() - expected).abs() < 1e-12);
        assert!(a.distance(&a).unwrap() < 1e-12);
    }
}

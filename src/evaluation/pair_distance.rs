//! How wide a set of vectors is spread.

use ndarray::ArrayView2;

/// Mean Euclidean distance of two vectors, over all pairs, `[vectors, numbers]`. None of fewer than
/// two.
#[must_use]
pub fn mean_pair_distance(vectors: ArrayView2<'_, f64>) -> Option<f64> {
    let count = vectors.nrows();
    let pairs = (0..count).flat_map(|a| (0..a).map(move |b| (a, b)));
    let distance = |(a, b): (usize, usize)| {
        let difference = &vectors.row(a) - &vectors.row(b);
        difference.dot(&difference).sqrt()
    };
    let sum: f64 = pairs.map(distance).sum();
    (count > 1).then(|| 2.0 * sum / (count * (count - 1)) as f64)
}

#[cfg(test)]
mod tests {
    use ndarray::array;

    use super::mean_pair_distance;

    #[test]
    fn it_is_a_mean_over_pairs() {
        let vectors = array![[0.0, 0.0], [3.0, 4.0], [0.0, 8.0]];
        let expected = (5.0 + 8.0 + 5.0) / 3.0;
        assert!((mean_pair_distance(vectors.view()).unwrap() - expected).abs() < 1e-12);
        assert_eq!(mean_pair_distance(array![[1.0, 2.0]].view()), None);
    }
}

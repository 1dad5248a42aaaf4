//! How evenly a dance moves: differences of the numbers of its rotations from frame to frame.

use ndarray::{ArrayView2, Axis, s};

/// Smoothness (eq. 16): standard deviation over |mean| of all differences from frame to frame,
/// those of all numbers and frames pooled (population standard deviation). No unit; lower is
/// called smoother.
///
/// `numbers`: 6-D rotations in the window's own orientation, `[frames, 6 J]`. Their mean
/// difference is near 0, so the ratio is large and wanders; none where it is 0.
#[must_use]
pub fn smoothness(numbers: ArrayView2<'_, f64>) -> Option<f64> {
    let differences = differences(numbers);
    variation(differences.iter().copied())
}

/// Coefficient of variation of the step length |y_(t+1) - y_t|, the norm over the numbers of
/// rotations, in percent: how unevenly fast a window is (population standard deviation).
///
/// `numbers` as in [`smoothness`], though any orientation gives the same. None of a motion that
/// stands still.
#[must_use]
pub fn step_variation(numbers: ArrayView2<'_, f64>) -> Option<f64> {
    let differences = differences(numbers);
    let steps = differences.rows().into_iter();
    let steps: Vec<f64> = steps.map(|row| row.dot(&row).sqrt()).collect();
    Some(100.0 * variation(steps.iter().copied())?)
}

fn differences(numbers: ArrayView2<'_, f64>) -> ndarray::Array2<f64> {
    match numbers.len_of(Axis(0)) {
        0 => numbers.to_owned(),
        _ => &numbers.slice(s![1.., ..]) - &numbers.slice(s![..-1, ..]),
    }
}

/// Standard deviation / |mean|; none where the mean is 0 or there is nothing.
fn variation(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    (mean.abs() > 0.0).then(|| (squares / count).sqrt() / mean.abs())
}

/// The middle value; the mean of the two in the middle of an even number. None of none.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    match values.len() % 2 {
        1 => Some(upper),
        _ => Some(0.5 * (values.get(middle.checked_sub(1)?)? + upper)),
    }
}

#[cfg(test)]
mod tests {
    use ndarray::{Array2, array};

    use super::{median, smoothness, step_variation};

    #[test]
    fn differences_are_pooled_over_frames_and_numbers() {
        // Differences 1, 3 and 2, -2: mean 1, squared deviations 0, 4, 1, 9.
        let numbers = array![[0.0, 0.0], [1.0, 3.0], [3.0, 1.0]];
        let expected = (14.0f64 / 4.0).sqrt();
        assert!((smoothness(numbers.view()).unwrap() - expected).abs() < 1e-12);
        // Steps sqrt 10 and sqrt 8.
        let (a, b) = (10f64.sqrt(), 8f64.sqrt());
        let expected = 100.0 * (a - b) / (a + b);
        assert!((step_variation(numbers.view()).unwrap() - expected).abs() < 1e-12);
    }

    #[test]
    fn what_stands_still_has_neither() {
        for frames in 0..4 {
            let numbers = Array2::ones((frames, 3));
            assert_eq!(smoothness(numbers.view()), None);
            assert_eq!(step_variation(numbers.view()), None);
        }
    }

    #[test]
    fn the_median_is_the_middle() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(vec![4.0, 1.0, 3.0, 2.0]), Some(2.5));
    }
}

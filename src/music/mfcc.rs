//! Mel-frequency cepstral coefficients.

use std::f64::consts::PI;

use ndarray::{Array2, ArrayView2};

use super::mel::BANDS;

/// Coefficients that are kept, from the 0th on.
pub const COEFFICIENTS: usize = 20;

/// The orthonormal discrete cosine transform (II) of mel decibels [frames, 128], the coefficients
/// 0 to 19: [frames, 20] (librosa's `mfcc`).
#[must_use]
pub fn mfcc(decibels: ArrayView2<'_, f64>) -> Array2<f64> {
    let bands = BANDS as f64;
    let cosines = Array2::from_shape_fn((BANDS, COEFFICIENTS), |(band, coefficient)| {
        let scale = if coefficient == 0 { 1.0 } else { 2.0 };
        let angle = PI * coefficient as f64 * (band as f64 + 0.5) / bands;
        (scale / bands).sqrt() * angle.cos()
    });
    decibels.dot(&cosines)
}

//! Sinusoidal positions (Vaswani et al. 2017, section 3.5).

use ndarray::Array2;

/// Positions 0 .. n - 1 as `[n, width]`: sin(p / 10000^(2i / width)) in column 2i, the cosine in
/// column 2i + 1.
pub fn sinusoidal_positions(n: usize, width: usize) -> Array2<f64> {
    Array2::from_shape_fn((n, width), |(position, column)| {
        let rate = 10_000f64.powf((column - column % 2) as f64 / width as f64);
        let angle = position as f64 / rate;
        if column % 2 == 0 {
            angle.sin()
        } else {
            angle.cos()
        }
    })
}

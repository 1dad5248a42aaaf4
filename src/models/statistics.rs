//! Numbers that are saved beside a model's weights.

use ndarray::ArrayD;

/// Named arrays that a model needs beside its weights and that training does not move, such as
/// means and deviations of its data: in f64 while they are in use, in f32 in the weights file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Statistics {
    arrays: Vec<(&'static str, ArrayD<f64>)>,
}

impl Statistics {
    /// The same with one more array.
    #[must_use]
    pub fn with(mut self, name: &'static str, array: ArrayD<f64>) -> Self {
        self.arrays.push((name, array));
        self
    }

    /// Names and values, in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = (&'static str, &ArrayD<f64>)> {
        self.arrays.iter().map(|(name, array)| (*name, array))
    }
}

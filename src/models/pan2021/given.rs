//! A batch as the network is given it.

use std::ops::Range;
use std::slice::ChunksExact;

use ndarray::Array3;

use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::motion::features::FEATURES;

/// Standardised features of windows, `[N + 1, windows, 154]`.
#[derive(Debug, Clone, Copy)]
pub(super) struct GivenFrames<'f, T> {
    values: &'f [T],
    pub windows: usize,
    /// N
    pub transition: usize,
}

impl<'f, T: Real> GivenFrames<'f, T> {
    /// # Errors
    /// Features of another shape, without a frame after k1, or not in standard layout.
    pub fn new(features: &'f Array3<T>) -> Result<Self, AutogradError> {
        let (frames, windows, numbers) = features.dim();
        match features.as_slice() {
            Some(values) if frames >= 2 && numbers == FEATURES => Ok(Self {
                values,
                windows,
                transition: frames - 1,
            }),
            _ => Err(AutogradError::Argument {
                operation: "pan2021",
                shape: features.shape().to_vec(),
                argument: "the features of a batch".into(),
                expected: "[N + 1, windows, 154] in standard layout, N at least 1",
            }),
        }
    }

    /// Frame k1 + `t` of each window, 154 numbers.
    pub fn frame(&self, t: usize) -> ChunksExact<'f, T> {
        let numbers = self.windows * FEATURES;
        self.values[t * numbers..(t + 1) * numbers].chunks_exact(FEATURES)
    }

    /// Frame k1 + `t` of one window, 154 numbers.
    pub fn row(&self, t: usize, window: usize) -> &'f [T] {
        &self.values[(t * self.windows + window) * FEATURES..][..FEATURES]
    }

    /// Columns of all frames, `[N + 1, windows, columns]`.
    pub fn all(&self, columns: Range<usize>) -> Vec<T> {
        self.values
            .chunks_exact(FEATURES)
            .flat_map(|row| row[columns.clone()].iter().copied())
            .collect()
    }

    /// Columns of frame k1 + `t` as a constant, `[windows, columns]`.
    pub fn constant(&self, tape: &mut Tape<'_, T>, t: usize, columns: Range<usize>) -> Var {
        tape.constant_with(&[self.windows, columns.len()], |out| {
            let rows = out.chunks_exact_mut(columns.len());
            for (out, row) in rows.zip(self.frame(t)) {
                out.copy_from_slice(&row[columns.clone()]);
            }
        })
    }
}

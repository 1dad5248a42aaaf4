//! Right operands laid out once for many products.

use super::{Mat, Real};

/// A right operand `[k, n]` of products, laid out once for many of them.
#[derive(Clone, Debug)]
pub struct Packed<T> {
    data: Vec<T>,
    rows: usize,
    cols: usize,
}

impl<T: Real> Packed<T> {
    /// B `[k, n]`.
    pub fn new(b: Mat<T>) -> Self {
        let mut packed = Self {
            data: Vec::new(),
            rows: 0,
            cols: 0,
        };
        packed.repack(b);
        packed
    }

    /// B^T `[k, n]` from b `[n, k]`.
    pub fn transposed(b: Mat<T>) -> Self {
        let mut packed = Self {
            data: Vec::new(),
            rows: 0,
            cols: 0,
        };
        packed.repack_transposed(b);
        packed
    }

    /// Replaces the operand by B `[k, n]`; the memory is used again.
    pub fn repack(&mut self, b: Mat<T>) {
        let b = b.checked();
        (self.rows, self.cols) = (b.rows, b.cols);
        self.data.clear();
        for i in 0..b.rows {
            self.data
                .extend_from_slice(&b.data[i * b.stride..][..b.cols]);
        }
    }

    /// Replaces the operand by B^T `[k, n]` from b `[n, k]`; the memory is used again.
    pub fn repack_transposed(&mut self, b: Mat<T>) {
        let b = b.checked();
        (self.rows, self.cols) = (b.cols, b.rows);
        self.data.clear();
        for i in 0..b.cols {
            self.data
                .extend((0..b.rows).map(|j| b.data[j * b.stride + i]));
        }
    }

    /// k, the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// n, the number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    pub(super) fn matrix(&self) -> Mat<'_, T> {
        Mat::new(&self.data, self.rows, self.cols)
    }
}

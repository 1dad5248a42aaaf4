//! Right operands laid out once for many products.

use super::{Isa, Mat, Real, buffer::Buffer, matrix::Operand};

/// A right operand `[k, n]` of products, laid out once for many of them.
///
/// For the f32 kernels the columns stand in panels as wide as a kernel's tile, each with its rows
/// one after another, the last filled up with zeros.
#[derive(Clone, Debug)]
pub struct Packed<T> {
    isa: Isa,
    buffer: Buffer<T>,
    rows: usize,
    cols: usize,
}

impl<T: Real> Packed<T> {
    /// B `[k, n]`.
    pub fn new(b: Mat<T>) -> Self {
        Self::new_on(Isa::detected(), Operand::new(b))
    }

    /// B^T `[k, n]` from b `[n, k]`.
    pub fn transposed(b: Mat<T>) -> Self {
        Self::new_on(Isa::detected(), Operand::transpose(b))
    }

    pub(super) fn new_on(isa: Isa, b: Operand<T>) -> Self {
        let mut buffer = Buffer::new();
        T::pack(isa, b, &mut buffer);
        Self {
            isa,
            buffer,
            rows: b.rows(),
            cols: b.cols(),
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    pub(super) fn cols(&self) -> usize {
        self.cols
    }

    pub(super) fn isa(&self) -> Isa {
        self.isa
    }

    pub(super) fn data(&self) -> &[T] {
        self.buffer.as_slice()
    }
}

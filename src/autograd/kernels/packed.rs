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
        Self::new_for(Isa::detected(), b)
    }

    /// B^T `[k, n]` from b `[n, k]`.
    pub fn transposed(b: Mat<T>) -> Self {
        Self::new_on(Isa::detected(), Operand::transpose(b))
    }

    /// B `[k, n]` for the kernels of one instruction set, to compare them.
    ///
    /// # Panics
    /// When this CPU lacks the set.
    pub fn new_for(isa: Isa, b: Mat<T>) -> Self {
        Self::new_on(isa, Operand::new(b))
    }

    /// Replaces the operand by B `[k, n]`; the memory is used again.
    pub fn repack(&mut self, b: Mat<T>) {
        self.pack(Operand::new(b));
    }

    /// Replaces the operand by B^T `[k, n]` from b `[n, k]`; the memory is used again.
    pub fn repack_transposed(&mut self, b: Mat<T>) {
        self.pack(Operand::transpose(b));
    }

    /// k, the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// n, the number of columns.
    pub fn cols(&self) -> usize {
        self.cols
    }

    pub(super) fn new_on(isa: Isa, b: Operand<T>) -> Self {
        let mut packed = Self {
            isa,
            buffer: Buffer::new(),
            rows: 0,
            cols: 0,
        };
        packed.pack(b);
        packed
    }

    pub(super) fn isa(&self) -> Isa {
        self.isa
    }

    pub(super) fn data(&self) -> &[T] {
        self.buffer.as_slice()
    }

    fn pack(&mut self, b: Operand<T>) {
        (self.rows, self.cols) = (b.rows(), b.cols());
        T::pack(self.isa, b, &mut self.buffer);
    }
}

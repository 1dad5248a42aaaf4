//! Right operands laid out once for many products.

use std::sync::{Mutex, OnceLock, PoisonError};

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
        Self::in_place_of(None, isa, b)
    }

    /// The same in the memory of another.
    fn in_place_of(former: Option<Self>, isa: Isa, b: Operand<T>) -> Self {
        let mut buffer = former.map_or_else(Buffer::new, |former| former.buffer);
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

/// A [`Packed`] of a matrix that changes now and then: made when it is first asked for, in the
/// memory of the one before.
#[derive(Debug)]
pub struct Repacked<T> {
    made: OnceLock<Packed<T>>,
    former: Mutex<Option<Packed<T>>>,
}

impl<T> Default for Repacked<T> {
    /// Not made yet.
    fn default() -> Self {
        Self {
            made: OnceLock::new(),
            former: Mutex::new(None),
        }
    }
}

impl<T: Real> Repacked<T> {
    /// B `[k, n]` as it was at the first call since [`Repacked::forget`].
    pub fn get<'m>(&self, b: impl FnOnce() -> Mat<'m, T>) -> &Packed<T>
    where
        T: 'm,
    {
        self.get_on(|| Operand::new(b()))
    }

    /// B^T `[k, n]` from b `[n, k]`, likewise.
    pub fn get_transposed<'m>(&self, b: impl FnOnce() -> Mat<'m, T>) -> &Packed<T>
    where
        T: 'm,
    {
        self.get_on(|| Operand::transpose(b()))
    }

    fn get_on<'m>(&self, b: impl FnOnce() -> Operand<'m, T>) -> &Packed<T>
    where
        T: 'm,
    {
        self.made.get_or_init(|| {
            let mut former = self.former.lock().unwrap_or_else(PoisonError::into_inner);
            Packed::in_place_of(former.take(), Isa::detected(), b())
        })
    }

    /// The matrix is another now.
    pub fn forget(&mut self) {
        if let Some(made) = self.made.take() {
            let former = self.former.get_mut();
            *former.unwrap_or_else(PoisonError::into_inner) = Some(made);
        }
    }
}

impl<T: Clone> Clone for Repacked<T> {
    fn clone(&self) -> Self {
        Self {
            made: self.made.clone(),
            former: Mutex::new(None),
        }
    }
}

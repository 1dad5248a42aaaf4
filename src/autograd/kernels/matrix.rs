//! Row-major matrices that are views into slices.

use std::ops::Range;

/// A row-major matrix in a slice, columns adjacent: a [`Mat`] or a [`MatMut`].
#[derive(Clone, Copy, Debug)]
pub struct Matrix<S> {
    /// The numbers; element `(i, j)` at `i * stride + j`.
    pub data: S,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub cols: usize,
    /// Distance between the starts of two adjacent rows, at least `cols`.
    pub stride: usize,
}

/// A matrix to read.
pub type Mat<'a, T> = Matrix<&'a [T]>;
/// A matrix to write.
pub type MatMut<'a, T> = Matrix<&'a mut [T]>;

/// A slice, to read or to write.
pub trait Numbers {
    fn count(&self) -> usize;

    /// The numbers from `start` on, none beyond the last.
    fn from(self, start: usize) -> Self;
}

impl<T> Numbers for &[T] {
    #[inline]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline]
    fn from(self, start: usize) -> Self {
        self.get(start..).unwrap_or_default()
    }
}

impl<T> Numbers for &mut [T] {
    #[inline]
    fn count(&self) -> usize {
        self.len()
    }

    #[inline]
    fn from(self, start: usize) -> Self {
        self.get_mut(start..).unwrap_or_default()
    }
}

/// Panics unless `rows` rows of `cols` numbers, `stride` apart, lie within `len` numbers.
#[inline]
#[track_caller]
fn check(len: usize, rows: usize, cols: usize, stride: usize) {
    if rows == 0 || cols == 0 {
        return;
    }
    assert!(
        rows == 1 || stride >= cols,
        "rows of a {rows} x {cols} matrix overlap at stride {stride}"
    );
    let needed = (rows - 1)
        .checked_mul(stride)
        .and_then(|start| start.checked_add(cols));
    assert!(
        needed.is_some_and(|needed| needed <= len),
        "a {rows} x {cols} matrix of stride {stride} does not fit in {len} numbers"
    );
}

impl<S: Numbers> Matrix<S> {
    /// A matrix without gaps between its rows.
    ///
    /// # Panics
    /// When `data` holds fewer than `rows * cols` numbers.
    #[inline]
    #[track_caller]
    pub fn new(data: S, rows: usize, cols: usize) -> Self {
        Self::strided(data, rows, cols, cols)
    }

    /// A matrix whose rows start `stride` numbers apart.
    ///
    /// # Panics
    /// When the rows overlap or do not lie within `data`.
    #[inline]
    #[track_caller]
    pub fn strided(data: S, rows: usize, cols: usize, stride: usize) -> Self {
        let matrix = Self {
            data,
            rows,
            cols,
            stride,
        };
        matrix.checked()
    }

    /// A range of the columns.
    ///
    /// # Panics
    /// When the range goes beyond the columns.
    #[inline]
    #[track_caller]
    pub fn columns(self, range: Range<usize>) -> Self {
        assert!(range.end <= self.cols, "columns {range:?} of {}", self.cols);
        Self {
            data: self.data.from(range.start),
            cols: range.len(),
            ..self
        }
    }

    /// Checks the shape again: the fields are open, and kernels rely on it.
    #[inline]
    #[track_caller]
    pub(super) fn checked(self) -> Self {
        check(self.data.count(), self.rows, self.cols, self.stride);
        self
    }
}

/// A matrix or its transpose, as an operand of a product.
#[derive(Clone, Copy, Debug)]
pub struct Operand<'a, T> {
    /// The matrix as it lies in memory.
    pub matrix: Mat<'a, T>,
    /// Whether the operand is its transpose.
    pub transposed: bool,
}

impl<'a, T> Operand<'a, T> {
    /// The matrix itself; its shape is checked again, as kernels rely on it.
    #[inline]
    #[track_caller]
    pub fn new(matrix: Mat<'a, T>) -> Self {
        Self {
            matrix: matrix.checked(),
            transposed: false,
        }
    }

    /// The transpose; the shape is checked again, as kernels rely on it.
    #[inline]
    #[track_caller]
    pub fn transpose(matrix: Mat<'a, T>) -> Self {
        Self {
            matrix: matrix.checked(),
            transposed: true,
        }
    }

    /// Number of rows of the operand.
    #[inline]
    pub fn rows(&self) -> usize {
        if self.transposed {
            self.matrix.cols
        } else {
            self.matrix.rows
        }
    }

    /// Number of columns of the operand.
    #[inline]
    pub fn cols(&self) -> usize {
        if self.transposed {
            self.matrix.rows
        } else {
            self.matrix.cols
        }
    }

    /// Distances between adjacent rows and between adjacent columns of the operand.
    #[inline]
    pub fn strides(&self) -> (usize, usize) {
        let stride = self.matrix.stride;
        if self.transposed {
            (1, stride)
        } else {
            (stride, 1)
        }
    }
}

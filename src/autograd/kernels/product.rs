//! The matrix products of the engine behind one interface.
//!
//! All run on the calling thread, and the same call gives the same bits. In f32 on AVX-512 or AVX2
//! a row of the result has the same bits whatever other rows are in the call, whether B is packed
//! or not, and on either set. NaN and infinities spread as in the plain sum. What memory a product
//! needs stays with its thread for the next one.

use super::{Isa, Mat, MatMut, Packed, Real, matrix::Operand};

/// C = A B, or C += A B with `accumulate`; A `[m, k]`, B `[k, n]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    let (a, b) = (Operand::new(a), Operand::new(b));
    product_on(Isa::detected(), a, b, c, accumulate);
}

/// C = A B^T, or C += A B^T with `accumulate`; A `[m, k]`, B `[n, k]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_bt<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    let (a, b) = (Operand::new(a), Operand::transpose(b));
    product_on(Isa::detected(), a, b, c, accumulate);
}

/// C = A^T B, or C += A^T B with `accumulate`; A `[k, m]`, B `[k, n]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_at<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    let (a, b) = (Operand::transpose(a), Operand::new(b));
    product_on(Isa::detected(), a, b, c, accumulate);
}

/// C = A B, or C += A B with `accumulate`; A `[m, k]`, B `[k, n]` packed, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_packed<T: Real>(a: Mat<T>, b: &Packed<T>, c: MatMut<T>, accumulate: bool) {
    let (a, c) = (Operand::new(a), c.checked());
    fit((a.rows(), a.cols()), (b.rows(), b.cols()), (c.rows, c.cols));
    T::product_packed(b.isa(), a, b.data(), c, accumulate);
}

/// C (+)= A B on one instruction set.
#[track_caller]
pub(super) fn product_on<T: Real>(
    isa: Isa,
    a: Operand<T>,
    b: Operand<T>,
    c: MatMut<T>,
    accumulate: bool,
) {
    let c = c.checked();
    fit((a.rows(), a.cols()), (b.rows(), b.cols()), (c.rows, c.cols));
    T::product(isa, a, b, c, accumulate);
}

/// Panics unless a product of shapes `a` and `b` has shape `c`.
#[inline]
#[track_caller]
fn fit(a: (usize, usize), b: (usize, usize), c: (usize, usize)) {
    assert!(
        a.1 == b.0 && c == (a.0, b.1),
        "a product of {a:?} and {b:?} does not give {c:?}"
    );
}

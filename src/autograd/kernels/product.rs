//! The matrix products of the engine behind one interface.

use super::{Mat, MatMut, Packed, Real};

/// C = A B, or C += A B with `accumulate`; A `[m, k]`, B `[k, n]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    strided(
        (a.checked(), false),
        (b.checked(), false),
        c.checked(),
        accumulate,
    );
}

/// C = A B^T, or C += A B^T with `accumulate`; A `[m, k]`, B `[n, k]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_bt<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    strided(
        (a.checked(), false),
        (b.checked(), true),
        c.checked(),
        accumulate,
    );
}

/// C = A^T B, or C += A^T B with `accumulate`; A `[k, m]`, B `[k, n]`, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_at<T: Real>(a: Mat<T>, b: Mat<T>, c: MatMut<T>, accumulate: bool) {
    strided(
        (a.checked(), true),
        (b.checked(), false),
        c.checked(),
        accumulate,
    );
}

/// C = A B, or C += A B with `accumulate`; A `[m, k]`, B `[k, n]` packed, C `[m, n]`.
///
/// # Panics
/// When the shapes do not fit each other.
#[track_caller]
pub fn product_packed<T: Real>(a: Mat<T>, b: &Packed<T>, c: MatMut<T>, accumulate: bool) {
    product(a, b.matrix(), c, accumulate);
}

#[track_caller]
fn strided<T: Real>(a: (Mat<T>, bool), b: (Mat<T>, bool), c: MatMut<T>, accumulate: bool) {
    let (m, ka, rsa, csa) = oriented(a);
    let (kb, n, rsb, csb) = oriented(b);
    assert!(
        ka == kb && c.rows == m && c.cols == n,
        "a product of [{m}, {ka}] and [{kb}, {n}] into [{}, {}]",
        c.rows,
        c.cols
    );
    if m == 0 || n == 0 {
        return;
    }
    let beta = if accumulate { T::one() } else { T::zero() };
    // SAFETY: shapes agree, and each was checked against its slice; C is borrowed exclusively.
    unsafe {
        T::gemm(
            m,
            ka,
            n,
            (a.0.data.as_ptr(), rsa, csa),
            (b.0.data.as_ptr(), rsb, csb),
            beta,
            (c.data.as_mut_ptr(), c.stride as isize, 1),
        );
    }
}

/// Rows, columns, row stride and column stride of a matrix or its transpose.
fn oriented<T>((matrix, transposed): (Mat<T>, bool)) -> (usize, usize, isize, isize) {
    let stride = matrix.stride as isize;
    if transposed {
        (matrix.cols, matrix.rows, 1, stride)
    } else {
        (matrix.rows, matrix.cols, stride, 1)
    }
}

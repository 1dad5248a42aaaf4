//! Products by `matrixmultiply`: f64 on every CPU, f32 on those that our kernels do not fit.

/// A product with strides, C = A B + beta C, by type.
pub trait Gemm: Sized {
    /// C = A B + beta C; element `(i, j)` of a matrix is at `i * row stride + j * column stride`.
    ///
    /// # Safety
    /// Every element of the `m x k`, `k x n` and `m x n` matrices must be valid to read, those of
    /// C also to write, and C's must not overlap each other or A's or B's.
    unsafe fn gemm(
        m: usize,
        k: usize,
        n: usize,
        a: (*const Self, isize, isize),
        b: (*const Self, isize, isize),
        beta: Self,
        c: (*mut Self, isize, isize),
    );
}

impl Gemm for f32 {
    unsafe fn gemm(
        m: usize,
        k: usize,
        n: usize,
        a: (*const Self, isize, isize),
        b: (*const Self, isize, isize),
        beta: Self,
        c: (*mut Self, isize, isize),
    ) {
        // SAFETY: the caller's promise is the one asked for.
        unsafe {
            matrixmultiply::sgemm(
                m, k, n, 1.0, a.0, a.1, a.2, b.0, b.1, b.2, beta, c.0, c.1, c.2,
            )
        }
    }
}

impl Gemm for f64 {
    unsafe fn gemm(
        m: usize,
        k: usize,
        n: usize,
        a: (*const Self, isize, isize),
        b: (*const Self, isize, isize),
        beta: Self,
        c: (*mut Self, isize, isize),
    ) {
        // SAFETY: the caller's promise is the one asked for.
        unsafe {
            matrixmultiply::dgemm(
                m, k, n, 1.0, a.0, a.1, a.2, b.0, b.1, b.2, beta, c.0, c.1, c.2,
            )
        }
    }
}

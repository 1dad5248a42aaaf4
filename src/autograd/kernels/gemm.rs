//! What the number types do differently in a product.

use super::{Isa, Mat, MatMut, blocked, buffer::Buffer, matrix::Operand};

/// The products of one number type. Shapes have been checked by the callers in `product`.
///
/// Sealed: the module is private.
pub trait Gemm: Sized + Copy + Default {
    /// C (+)= A B.
    fn product(isa: Isa, a: Operand<Self>, b: Operand<Self>, c: MatMut<Self>, accumulate: bool);

    /// C (+)= A B, with B `[k, n]` as [`Gemm::pack`] left it.
    fn product_packed(isa: Isa, a: Operand<Self>, b: &[Self], c: MatMut<Self>, accumulate: bool);

    /// Lays B out for [`Gemm::product_packed`].
    fn pack(isa: Isa, b: Operand<Self>, packed: &mut Buffer<Self>);
}

/// `Gemm` by one of the products of `matrixmultiply`.
macro_rules! matrixmultiply {
    ($multiply:ident, $number:ty, $gemm:path) => {
        fn $multiply(
            a: Operand<$number>,
            b: Operand<$number>,
            c: MatMut<$number>,
            accumulate: bool,
        ) {
            let (rsa, csa) = a.strides();
            let (rsb, csb) = b.strides();
            let beta = if accumulate { 1.0 } else { 0.0 };
            // SAFETY: the callers checked that the shapes agree and that each matrix lies within
            // its slice; C is borrowed exclusively.
            unsafe {
                $gemm(
                    a.rows(),
                    a.cols(),
                    b.cols(),
                    1.0,
                    a.matrix.data.as_ptr(),
                    rsa as isize,
                    csa as isize,
                    b.matrix.data.as_ptr(),
                    rsb as isize,
                    csb as isize,
                    beta,
                    c.data.as_mut_ptr(),
                    c.stride as isize,
                    1,
                );
            }
        }
    };
}

matrixmultiply!(multiply_single, f32, matrixmultiply::sgemm);
matrixmultiply!(multiply_double, f64, matrixmultiply::dgemm);

/// Lays B out row by row.
fn pack_rows<T: Copy + Default>(b: Operand<T>, packed: &mut Buffer<T>) {
    let (rows, cols) = (b.rows(), b.cols());
    let (rs, cs) = b.strides();
    let packed = packed.resized(rows * cols);
    if rows == 0 || cols == 0 {
        return;
    }
    for (i, row) in packed[..rows * cols].chunks_exact_mut(cols).enumerate() {
        for (j, to) in row.iter_mut().enumerate() {
            *to = b.matrix.data[i * rs + j * cs];
        }
    }
}

impl Gemm for f32 {
    fn product(isa: Isa, a: Operand<Self>, b: Operand<Self>, c: MatMut<Self>, accumulate: bool) {
        match isa.kernels() {
            Some(kernels) => blocked::product(kernels, a, b, c, accumulate),
            None => multiply_single(a, b, c, accumulate),
        }
    }

    fn product_packed(isa: Isa, a: Operand<Self>, b: &[Self], c: MatMut<Self>, accumulate: bool) {
        match isa.kernels() {
            Some(kernels) => blocked::product_packed(kernels, a, b, c, accumulate),
            None => {
                let b = Operand::new(Mat::new(b, a.cols(), c.cols));
                multiply_single(a, b, c, accumulate);
            }
        }
    }

    fn pack(isa: Isa, b: Operand<Self>, packed: &mut Buffer<Self>) {
        match isa.kernels() {
            Some(kernels) => blocked::pack(kernels, b, packed),
            None => pack_rows(b, packed),
        }
    }
}

impl Gemm for f64 {
    fn product(_: Isa, a: Operand<Self>, b: Operand<Self>, c: MatMut<Self>, accumulate: bool) {
        multiply_double(a, b, c, accumulate);
    }

    fn product_packed(_: Isa, a: Operand<Self>, b: &[Self], c: MatMut<Self>, accumulate: bool) {
        let b = Operand::new(Mat::new(b, a.cols(), c.cols));
        multiply_double(a, b, c, accumulate);
    }

    fn pack(_: Isa, b: Operand<Self>, packed: &mut Buffer<Self>) {
        pack_rows(b, packed);
    }
}

//! Matrix product.
//!
//! ```text
//! A [m, k], B [k, n] -> C [m, n] = A B; dA = dC B^T, dB = A^T dC.
//! ```

use super::shapes_error;
use crate::autograd::kernels::{Mat, MatMut, product, product_at, product_bt};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Matmul {
    a: Var,
    b: Var,
    sizes: [usize; 3],
}

impl<T: Real> Operation<T> for Matmul {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let [m, k, n] = self.sizes;
        let dc = Mat::new(dy, m, n);
        let a = Mat::new(context.values(self.a), m, k);
        let b = Mat::new(context.values(self.b), k, n);
        if let Some(target) = context.target(self.a) {
            product_bt(dc, b, MatMut::new(target.data, m, k), !target.fresh);
        }
        if let Some(target) = context.target(self.b) {
            product_at(a, dc, MatMut::new(target.data, k, n), !target.fresh);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The matrix product of `a [m, k]` and `b [k, n]`, as `[m, n]`.
    ///
    /// # Errors
    /// Operands that are no matrices, or whose inner axes differ.
    pub fn matmul(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        self.own("matmul", &[a, b])?;
        let (left, right) = (self.shape(a), self.shape(b));
        let (&[m, k], &[inner, n]) = (left, right) else {
            return Err(shapes_error("matmul", left, right, "[m, k] and [k, n]"));
        };
        if inner != k {
            return Err(shapes_error("matmul", left, right, "[m, k] and [k, n]"));
        }
        let mut y = self.take_for("matmul", &[m, n])?;
        product(
            Mat::new(self.values(a), m, k),
            Mat::new(self.values(b), k, n),
            MatMut::new(&mut y, m, n),
            false,
        );
        let sizes = [m, k, n];
        Ok(self.put("matmul", &[a, b], &[m, n], y, || Matmul { a, b, sizes }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        drawn((0usize..5, 0usize..5, 0usize..5), |(m, k, n), seed| {
            case(&[&[m, k], &[k, n]], seed, 0.0, |tape, v| {
                tape.matmul(v[0], v[1])
            })
        })
    }
}

//! Softmax along the last axis.
//!
//! ```text
//! x [.., n] -> y [.., n], y_j = exp(x_j - max) / sum_k exp(x_k - max); dX_j = y_j (dY_j - sum_k dY_k y_k).
//! ```

use crate::autograd::reduce::sum_with;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct Softmax {
    x: Var,
    columns: usize,
}

impl<T: Real> Operation<T> for Softmax {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let y = context.output();
        let columns = self.columns.max(1);
        for (dy, y) in dy.chunks_exact_mut(columns).zip(y.chunks_exact(columns)) {
            softmax_backward(dy, y);
        }
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
    }
}

/// x - max in place for one row.
#[inline(always)]
fn shifted<T: Real>(x: &mut [T]) {
    let mut max = T::neg_infinity();
    for &x in &*x {
        if x > max || x.is_nan() {
            max = x;
        }
    }
    for x in x {
        *x -= max;
    }
}

/// Softmax of each row of `x [rows, columns]`, in place.
pub(super) fn softmax_rows<T: Real>(x: &mut [T], columns: usize) {
    if columns == 0 {
        return;
    }
    for row in x.chunks_exact_mut(columns) {
        shifted(row);
    }
    T::exp_slice(x);
    for row in x.chunks_exact_mut(columns) {
        let scale = T::one() / sum_with(row.len(), |j| row[j]);
        for x in row {
            *x *= scale;
        }
    }
}

/// dX of one row, in place of dY.
#[inline(always)]
pub(super) fn softmax_backward<T: Real>(dy: &mut [T], y: &[T]) {
    let mean = sum_with(y.len(), |j| dy[j] * y[j]);
    for (d, &y) in dy.iter_mut().zip(y) {
        *d = y * (*d - mean);
    }
}

impl<T: Real> Tape<'_, T> {
    /// Softmax of each row of `x [.., n]`.
    pub fn softmax(&mut self, x: Var) -> Var {
        let shape = self.shape(x).to_vec();
        let columns = self.rows_and_columns(x).1;
        let mut y = self.take(self.values(x).len());
        y.copy_from_slice(self.values(x));
        softmax_rows(&mut y, columns);
        self.record("softmax", &[x], &shape, y, || Softmax { x, columns })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, shapes, strength};

    pub fn cases() -> Cases {
        (shapes(), strength(), any::<u64>())
            .prop_map(|(x, strength, seed)| {
                case(&[&x], seed, 0.0, move |tape, v| {
                    let logits = tape.affine(v[0], strength, 0.0);
                    Ok(tape.softmax(logits))
                })
            })
            .boxed()
    }
}

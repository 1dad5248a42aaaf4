//! Softmax along the last axis.
//!
//! ```text
//! x [.., n] -> y [.., n], y_j = exp(x_j - max) / sum_k exp(x_k - max);
//! dX_j = y_j (dY_j - sum_k dY_k y_k).
//! ```

use crate::autograd::reduce::sum_with;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct Softmax {
    x: Var,
    columns: usize,
}

impl<T: Real> Operation<T> for Softmax {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let rows = context.output().chunks_exact(self.columns);
        for (dy, y) in dy.chunks_exact_mut(self.columns).zip(rows) {
            let mean = sum_with(y.len(), |j| dy[j] * y[j]);
            dy.iter_mut()
                .zip(y)
                .for_each(|(d, &y)| *d = y * (*d - mean));
        }
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
    }
}

/// x - max in place for one row; a NaN is its maximum.
pub(super) fn shift<T: Real>(row: &mut [T]) {
    let larger = |max: T, &x: &T| if x > max || x.is_nan() { x } else { max };
    let max = row.iter().fold(T::neg_infinity(), larger);
    row.iter_mut().for_each(|x| *x -= max);
}

impl<T: Real> Tape<'_, T> {
    /// Softmax of each row of `x [.., n]`.
    pub fn softmax(&mut self, x: Var) -> Var {
        if let Err(error) = self.own("softmax", &[x]) {
            return self.refuse(error);
        }
        let columns = self.rows_and_columns(x).1.max(1);
        let (shape, mut y) = self.copy(x);
        y.chunks_exact_mut(columns).for_each(shift);
        T::exp_slice(&mut y);
        for row in y.chunks_exact_mut(columns) {
            let scale = T::one() / sum_with(row.len(), |j| row[j]);
            row.iter_mut().for_each(|x| *x *= scale);
        }
        self.put("softmax", &[x], &shape, y, || Softmax { x, columns })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes, strength};

    pub fn cases() -> Cases {
        drawn((shapes(), strength()), |(x, strength), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                let logits = tape.affine(v[0], strength, 0.0);
                Ok(tape.softmax(logits))
            })
        })
    }
}

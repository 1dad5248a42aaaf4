//! Logarithm of the softmax along the last axis.
//!
//! ```text
//! x [.., n] -> y [.., n], y_j = x_j - max - ln(sum_k exp(x_k - max));
//! dX_j = dY_j - exp(y_j) sum_k dY_k.
//! ```

use super::softmax::shift;
use crate::autograd::reduce::sum_with;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct LogSoftmax {
    x: Var,
    columns: usize,
}

impl<T: Real> Operation<T> for LogSoftmax {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let mut p = context.take(dy.len());
        p.copy_from_slice(context.output());
        T::exp_slice(&mut p);
        let rows = p.chunks_exact(self.columns);
        for (dy, p) in dy.chunks_exact_mut(self.columns).zip(rows) {
            let sum = sum_with(dy.len(), |j| dy[j]);
            dy.iter_mut().zip(p).for_each(|(d, &p)| *d -= p * sum);
        }
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
        context.give(p);
    }
}

impl<T: Real> Tape<'_, T> {
    /// Logarithm of the softmax of each row of `x [.., n]`, exact where the softmax rounds to 0.
    pub fn log_softmax(&mut self, x: Var) -> Var {
        if let Err(error) = self.own("log_softmax", &[x]) {
            return self.refuse(error);
        }
        let columns = self.rows_and_columns(x).1.max(1);
        let (shape, mut y) = self.copy(x);
        y.chunks_exact_mut(columns).for_each(shift);
        let mut e = self.take(y.len());
        e.copy_from_slice(&y);
        T::exp_slice(&mut e);
        for (y, e) in y.chunks_exact_mut(columns).zip(e.chunks_exact(columns)) {
            let ln = sum_with(columns, |j| e[j]).ln();
            y.iter_mut().for_each(|y| *y -= ln);
        }
        self.give(e);
        self.put("log_softmax", &[x], &shape, y, || LogSoftmax { x, columns })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes, strength};

    pub fn cases() -> Cases {
        drawn((shapes(), strength()), |(x, strength), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                let logits = tape.affine(v[0], strength, 0.0);
                Ok(tape.log_softmax(logits))
            })
        })
    }
}

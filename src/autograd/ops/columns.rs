//! Columns: a range of the last axis.
//!
//! ```text
//! x [.., n] -> y [.., width], y[.., j] = x[.., start + j]; dX is dY there and 0 elsewhere.
//! ```

use std::ops::Range;

use super::argument_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Columns {
    x: Var,
    start: usize,
    width: usize,
    total: usize,
}

impl<T: Real> Operation<T> for Columns {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let Some(target) = context.target(self.x) else {
            return;
        };
        if target.fresh {
            target.data.fill(T::zero());
        }
        if self.width == 0 {
            return;
        }
        for (dx, dy) in target
            .data
            .chunks_exact_mut(self.total)
            .zip(dy.chunks_exact(self.width))
        {
            for (dx, &dy) in dx[self.start..self.start + self.width].iter_mut().zip(dy) {
                *dx += dy;
            }
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The columns `range` of `x [.., n]`, as `[.., range.len()]`.
    ///
    /// # Errors
    /// A range beyond the last axis.
    pub fn columns(&mut self, x: Var, range: Range<usize>) -> Result<Var, AutogradError> {
        let (rows, total) = self.rows_and_columns(x);
        if self.shape(x).is_empty() || range.start > range.end || range.end > total {
            let argument = format!("columns {range:?}");
            let expected = "a range within the last axis";
            return Err(argument_error("columns", self.shape(x), argument, expected));
        }
        let (start, width) = (range.start, range.len());
        let mut y = self.take(rows * width);
        if width > 0 {
            let x = self.values(x);
            for (y, x) in y.chunks_exact_mut(width).zip(x.chunks_exact(total)) {
                y.copy_from_slice(&x[start..start + width]);
            }
        }
        let mut shape = self.shape(x).to_vec();
        if let Some(last) = shape.last_mut() {
            *last = width;
        }
        Ok(self.record("columns", &[x], &shape, y, || Columns {
            x,
            start,
            width,
            total,
        }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, shapes};

    pub fn cases() -> Cases {
        (shapes(), any::<[prop::sample::Index; 2]>(), any::<u64>())
            .prop_map(|(x, ends, seed)| {
                let n = x[x.len() - 1];
                let (a, b) = (ends[0].index(n + 1), ends[1].index(n + 1));
                let range = a.min(b)..a.max(b);
                case(&[&x], seed, 0.0, move |tape, v| {
                    tape.columns(v[0], range.clone())
                })
            })
            .boxed()
    }
}

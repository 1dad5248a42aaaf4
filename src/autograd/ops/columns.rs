//! Columns: a range of the last axis; also the core of [`super::rows`] and [`super::strided_rows`].
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
        let dx = target.so_far();
        if self.width == 0 {
            return;
        }
        let rows = dx.chunks_exact_mut(self.total);
        for (dx, dy) in rows.zip(dy.chunks_exact(self.width)) {
            for (dx, &dy) in dx[self.start..self.start + self.width].iter_mut().zip(dy) {
                *dx += dy;
            }
        }
    }
}

/// The columns `range` of `x` seen as rows of `total` numbers, under the shape `shape`.
pub(super) fn columns_of<T: Real>(
    tape: &mut Tape<'_, T>,
    name: &'static str,
    x: Var,
    (range, total): (Range<usize>, usize),
    shape: &[usize],
) -> Var {
    let (start, width) = (range.start, range.len());
    let mut y = tape.take(shape.iter().product());
    if !y.is_empty() {
        let rows = tape.values(x).chunks_exact(total);
        for (y, x) in y.chunks_exact_mut(width).zip(rows) {
            y.copy_from_slice(&x[range.clone()]);
        }
    }
    tape.put(name, &[x], shape, y, || Columns {
        x,
        start,
        width,
        total,
    })
}

impl<T: Real> Tape<'_, T> {
    /// The columns `range` of `x [.., n]`, as `[.., range.len()]`.
    ///
    /// # Errors
    /// A range beyond the last axis.
    pub fn columns(&mut self, x: Var, range: Range<usize>) -> Result<Var, AutogradError> {
        self.own("columns", &[x])?;
        let mut shape = self.shape(x).to_vec();
        match shape.last_mut() {
            Some(last) if range.start <= range.end && range.end <= *last => {
                let total = std::mem::replace(last, range.len());
                Ok(columns_of(self, "columns", x, (range, total), &shape))
            }
            _ => {
                let argument = format!("columns {range:?}");
                let expected = "a range within the last axis";
                Err(argument_error("columns", &shape, argument, expected))
            }
        }
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        let inputs = (shapes(), any::<[prop::sample::Index; 2]>());
        drawn(inputs, |(x, ends), seed| {
            let n = x[x.len() - 1];
            let (a, b) = (ends[0].index(n + 1), ends[1].index(n + 1));
            let range = a.min(b)..a.max(b);
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.columns(v[0], range.clone())
            })
        })
    }
}

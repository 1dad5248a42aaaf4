//! Rows: a range of the first axis.
//!
//! ```text
//! x [n, ..] -> y [height, ..], y[i, ..] = x[start + i, ..]; dX is dY there and 0 elsewhere.
//! ```

use std::ops::Range;

use super::argument_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Rows {
    x: Var,
    numbers: Range<usize>,
}

impl<T: Real> Operation<T> for Rows {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let Some(target) = context.target(self.x) else {
            return;
        };
        if target.fresh {
            target.data.fill(T::zero());
        }
        for (dx, &dy) in target.data[self.numbers.clone()].iter_mut().zip(&*dy) {
            *dx += dy;
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The rows `range` of `x [n, ..]`, as `[range.len(), ..]`.
    ///
    /// # Errors
    /// A range beyond the first axis.
    pub fn rows(&mut self, x: Var, range: Range<usize>) -> Result<Var, AutogradError> {
        let mut shape = self.shape(x).to_vec();
        let total = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || range.start > range.end || range.end > total {
            let argument = format!("rows {range:?}");
            let expected = "a range within the first axis";
            return Err(argument_error("rows", &shape, argument, expected));
        }
        let width: usize = shape.iter().skip(1).product();
        let numbers = range.start * width..range.end * width;
        if let Some(first) = shape.first_mut() {
            *first = range.len();
        }
        let mut y = self.take(numbers.len());
        y.copy_from_slice(&self.values(x)[numbers.clone()]);
        Ok(self.record("rows", &[x], &shape, y, || Rows { x, numbers }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, shapes};

    pub fn cases() -> Cases {
        (shapes(), any::<[prop::sample::Index; 2]>(), any::<u64>())
            .prop_map(|(x, ends, seed)| {
                let (a, b) = (ends[0].index(x[0] + 1), ends[1].index(x[0] + 1));
                let range = a.min(b)..a.max(b);
                case(&[&x], seed, 0.0, move |tape, v| {
                    tape.rows(v[0], range.clone())
                })
            })
            .boxed()
    }
}

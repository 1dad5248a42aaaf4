//! Rows: a range of the first axis.
//!
//! ```text
//! x [n, ..] -> y [height, ..], y[i, ..] = x[start + i, ..]; dX is dY there and 0 elsewhere.
//! ```

use std::ops::Range;

use super::argument_error;
use super::columns::columns_of;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// The rows `range` of `x [n, ..]`, as `[range.len(), ..]`.
    ///
    /// # Errors
    /// A range beyond the first axis.
    pub fn rows(&mut self, x: Var, range: Range<usize>) -> Result<Var, AutogradError> {
        self.own("rows", &[x])?;
        let mut shape = self.shape(x).to_vec();
        let total = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || range.start > range.end || range.end > total {
            let argument = format!("rows {range:?}");
            let expected = "a range within the first axis";
            return Err(argument_error("rows", &shape, argument, expected));
        }
        let width: usize = shape.iter().skip(1).product();
        let numbers = range.start * width..range.end * width;
        shape[0] = range.len();
        let all = total * width;
        Ok(columns_of(self, "rows", x, (numbers, all), &shape))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        let inputs = (shapes(), any::<[prop::sample::Index; 2]>());
        drawn(inputs, |(x, ends), seed| {
            let (a, b) = (ends[0].index(x[0] + 1), ends[1].index(x[0] + 1));
            let range = a.min(b)..a.max(b);
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.rows(v[0], range.clone())
            })
        })
    }
}

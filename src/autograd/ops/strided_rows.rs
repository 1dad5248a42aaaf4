//! Every n-th row: one token of each window.
//!
//! ```text
//! x [n * step, ..] -> y [n, ..], y[i] = x[start + i step]; dX is dY there and 0 elsewhere.
//! ```

use super::argument_error;
use super::columns::columns_of;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// Rows `start`, `start + step`, .. of `x [n * step, ..]`, as `[n, ..]`.
    ///
    /// # Errors
    /// A start beyond the step, rows that are no multiple of the step.
    pub fn strided_rows(
        &mut self,
        x: Var,
        start: usize,
        step: usize,
    ) -> Result<Var, AutogradError> {
        self.own("strided_rows", &[x])?;
        let mut shape = self.shape(x).to_vec();
        let rows = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || start >= step || rows % step != 0 {
            let argument = format!("rows from {start} in steps of {step}");
            let expected = "[n * step, ..] and a start below the step";
            return Err(argument_error("strided_rows", &shape, argument, expected));
        }
        let width: usize = shape.iter().skip(1).product();
        shape[0] = rows / step;
        // The rows of a step beside each other; without any row the step may be of any size.
        let at = |row: usize| row.saturating_mul(width);
        let (numbers, all) = (at(start)..at(start + 1), at(step));
        Ok(columns_of(self, "strided_rows", x, (numbers, all), &shape))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        let sizes = [0usize..4, 1..4, 0..3];
        let inputs = (sizes, any::<prop::sample::Index>());
        drawn(inputs, |([n, step, width], start), seed| {
            let start = start.index(step);
            case(&[&[n * step, width]], seed, 0.0, move |tape, v| {
                tape.strided_rows(v[0], start, step)
            })
        })
    }
}

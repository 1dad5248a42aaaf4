//! Every n-th row: one token of each window.
//!
//! ```text
//! x [n * step, ..] -> y [n, ..], y[i] = x[start + i step]; dX is dY there and 0 elsewhere.
//! ```

use super::argument_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct StridedRows {
    x: Var,
    start: usize,
    step: usize,
    width: usize,
}

impl<T: Real> Operation<T> for StridedRows {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let Some(target) = context.target(self.x) else {
            return;
        };
        if target.fresh {
            target.data.fill(T::zero());
        }
        let width = self.width;
        if width == 0 {
            return;
        }
        for (row, dy) in dy.chunks_exact(width).enumerate() {
            let from = (self.start + row * self.step) * width;
            let dx = &mut target.data[from..from + width];
            dx.iter_mut().zip(dy).for_each(|(dx, &dy)| *dx += dy);
        }
    }
}

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
        let mut shape = self.shape(x).to_vec();
        let rows = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || start >= step || rows % step != 0 {
            let argument = format!("rows from {start} in steps of {step}");
            let expected = "[n * step, ..] and a start below the step";
            return Err(argument_error("strided_rows", &shape, argument, expected));
        }
        let width: usize = shape.iter().skip(1).product();
        shape[0] = rows / step;
        let mut y = self.take(shape[0] * width);
        if width > 0 {
            let x = self.values(x);
            for (row, y) in y.chunks_exact_mut(width).enumerate() {
                let from = (start + row * step) * width;
                y.copy_from_slice(&x[from..from + width]);
            }
        }
        Ok(
            self.record("strided_rows", &[x], &shape, y, || StridedRows {
                x,
                start,
                step,
                width,
            }),
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case};

    pub fn cases() -> Cases {
        (
            0usize..4,
            1usize..4,
            0usize..3,
            any::<prop::sample::Index>(),
            any::<u64>(),
        )
            .prop_map(|(n, step, width, start, seed)| {
                let start = start.index(step);
                case(&[&[n * step, width]], seed, 0.0, move |tape, v| {
                    tape.strided_rows(v[0], start, step)
                })
            })
            .boxed()
    }
}

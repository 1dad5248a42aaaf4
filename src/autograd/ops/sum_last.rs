//! Sum along the last axis.
//!
//! ```text
//! x [.., n] -> y [..]; dX[.., j] = dY[..].
//! ```

use super::argument_error;
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct SumLast {
    x: Var,
    columns: usize,
}

impl<T: Real> Operation<T> for SumLast {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let columns = self.columns;
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i / columns]);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// Sums of the rows of `x [.., n]`, as `[..]`.
    ///
    /// # Errors
    /// A value without axes.
    pub fn sum_last(&mut self, x: Var) -> Result<Var, AutogradError> {
        self.own("sum_last", &[x])?;
        let Some((&columns, shape)) = self.shape(x).split_last() else {
            let argument = "its last axis".into();
            return Err(argument_error(
                "sum_last",
                &[],
                argument,
                "one axis or more",
            ));
        };
        let shape = shape.to_vec();
        let mut y = self.take_for("sum_last", &shape)?;
        let values = self.values(x);
        for (row, y) in y.iter_mut().enumerate() {
            *y = sum_with(columns, |j| values[row * columns + j]);
        }
        Ok(self.put("sum_last", &[x], &shape, y, || SumLast { x, columns }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| tape.sum_last(x))
    }
}

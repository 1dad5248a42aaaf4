//! Euclidean norm along the last axis, smooth at 0.
//!
//! ```text
//! x [.., n] -> y [..], y = sqrt(x . x + eps); dX = dY x / y.
//! ```

use super::argument_error;
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct VectorNorm {
    x: Var,
    columns: usize,
}

impl<T: Real> Operation<T> for VectorNorm {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (x, y, columns) = (context.values(self.x), context.output(), self.columns);
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i / columns] * x[i] / y[i / columns]);
        }
    }
}

/// What keeps a square root from 0, where it is a number above 0 in T, too.
pub(super) fn smoothing<T: Real>(operation: &'static str, eps: f64) -> Result<T, AutogradError> {
    let found = T::from_f64(eps);
    let valid = found > T::zero() && found.is_finite();
    AutogradError::unless(valid, operation, ("eps", eps), "a number above 0")?;
    Ok(found)
}

impl<T: Real> Tape<'_, T> {
    /// Norms of the rows of `x [.., n]`, as `[..]`; `eps` (above 0) keeps the gradient finite at 0.
    ///
    /// # Errors
    /// A value without axes; an `eps` that is not above 0.
    pub fn vector_norm(&mut self, x: Var, eps: f64) -> Result<Var, AutogradError> {
        self.own("vector_norm", &[x])?;
        let Some((&columns, shape)) = self.shape(x).split_last() else {
            let argument = "its last axis".into();
            let expected = "one axis or more";
            return Err(argument_error("vector_norm", &[], argument, expected));
        };
        let shape = shape.to_vec();
        let eps = smoothing("vector_norm", eps)?;
        let mut y = self.take_for("vector_norm", &shape)?;
        let values = self.values(x);
        for (row, y) in y.iter_mut().enumerate() {
            let row = &values[row * columns..(row + 1) * columns];
            *y = (sum_with(columns, |j| row[j] * row[j]) + eps).sqrt();
        }
        Ok(self.put("vector_norm", &[x], &shape, y, || VectorNorm { x, columns }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.1, |tape, x| tape.vector_norm(x, 1e-3))
    }
}

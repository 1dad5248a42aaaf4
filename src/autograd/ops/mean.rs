//! Mean of all numbers.
//!
//! ```text
//! x [..] of n numbers -> y [1]; dX = dY / n everywhere.
//! ```

use super::{argument_error, shapes_error};
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// Mean of all numbers of `x`, as `[1]`.
    ///
    /// # Errors
    /// A value without numbers, a value of another tape.
    pub fn mean(&mut self, x: Var) -> Result<Var, AutogradError> {
        self.own("mean", &[x])?;
        let count = self.values(x).len();
        if count == 0 {
            let shape = self.shape(x);
            let expected = "at least one number";
            return Err(argument_error("mean", shape, "nothing".into(), expected));
        }
        let sum = self.sum(x);
        Ok(self.affine(sum, 1.0 / count as f64, 0.0))
    }

    /// Mean of the squared differences of all numbers, as `[1]`: a loss.
    ///
    /// # Errors
    /// Other shapes than one another's, values without numbers or of another tape.
    pub fn mean_squared_error(&mut self, x: Var, target: Var) -> Result<Var, AutogradError> {
        self.own("mean_squared_error", &[x, target])?;
        let (left, right) = (self.shape(x), self.shape(target));
        if left != right {
            let expected = "equal shapes";
            return Err(shapes_error("mean_squared_error", left, right, expected));
        }
        let difference = self.sub(x, target)?;
        let squares = self.square(difference);
        self.mean(squares)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        let shape = prop::collection::vec(1usize..5, 1..4);
        drawn((shape, any::<bool>()), |(x, of_squares), seed| {
            case(&[&x, &x], seed, 0.0, move |tape, v| match of_squares {
                true => tape.mean_squared_error(v[0], v[1]),
                false => {
                    let product = tape.mul(v[0], v[1])?;
                    tape.mean(product)
                }
            })
        })
    }
}

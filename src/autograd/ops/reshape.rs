//! The same numbers under another shape.
//!
//! ```text
//! y = x; dX = dY.
//! ```

use super::shapes_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Reshape {
    x: Var,
}

impl<T: Real> Operation<T> for Reshape {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The numbers of `x` in row-major order under `shape`.
    ///
    /// # Errors
    /// A shape with another number of numbers.
    pub fn reshape(&mut self, x: Var, shape: &[usize]) -> Result<Var, AutogradError> {
        self.own("reshape", &[x])?;
        let numbers = shape.iter().try_fold(1, |n: usize, &k| n.checked_mul(k));
        if numbers != Some(self.values(x).len()) {
            let expected = "as many numbers on both sides";
            return Err(shapes_error("reshape", self.shape(x), shape, expected));
        }
        let mut y = self.take_for("reshape", shape)?;
        y.copy_from_slice(self.values(x));
        Ok(self.put("reshape", &[x], shape, y, || Reshape { x }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn(shapes(), |x, seed| {
            let mut reversed = x.clone();
            reversed.reverse();
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.reshape(v[0], &reversed)
            })
        })
    }
}

//! Difference of two values.
//!
//! ```text
//! c = a - b, with a and b broadcast to c's shape; dA = dC, dB = -dC, summed over the broadcast axes.
//! ```

use super::broadcast::{add_reduced, broadcast_shape, zip_into};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Sub {
    a: Var,
    b: Var,
    shape: Vec<usize>,
}

impl<T: Real> Operation<T> for Sub {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        for (operand, sign) in [(self.a, T::one()), (self.b, -T::one())] {
            let shape = context.shape(operand);
            if let Some(target) = context.target(operand) {
                let gradient = dy.iter().map(|&d| d * sign);
                add_reduced(target, shape, &self.shape, gradient);
            }
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// a - b, elementwise with broadcasting.
    ///
    /// # Errors
    /// Shapes that do not broadcast together.
    pub fn sub(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        let shape = broadcast_shape("sub", self.shape(a), self.shape(b))?;
        let mut y = self.take(shape.iter().product());
        zip_into(&mut y, &shape, self.array(a), self.array(b), |x, y| x - y);
        Ok(self.record("sub", &[a, b], &shape, y, || Sub {
            a,
            b,
            shape: shape.clone(),
        }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_two_values};

    pub fn cases() -> Cases {
        of_two_values(|tape, a, b| tape.sub(a, b))
    }
}

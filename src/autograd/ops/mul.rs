//! Product of two values, element by element.
//!
//! ```text
//! c = a * b, with a and b broadcast to c's shape;
//! dA = dC * b, dB = dC * a, summed over the broadcast axes.
//! ```

use super::broadcast::{add_reduced, broadcast_shape, zip_into};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Mul {
    a: Var,
    b: Var,
    shape: Vec<usize>,
}

impl<T: Real> Operation<T> for Mul {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        for (operand, other) in [(self.a, self.b), (self.b, self.a)] {
            let shape = context.shape(operand);
            let factor = context.array(other);
            let Some(factor) = factor.broadcast(self.shape.as_slice()) else {
                continue;
            };
            if let Some(target) = context.target(operand) {
                let gradient = dy.iter().zip(factor).map(|(&d, &x)| d * x);
                add_reduced(target, shape, &self.shape, gradient);
            }
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// a * b, elementwise with broadcasting.
    ///
    /// # Errors
    /// Shapes that do not broadcast together.
    pub fn mul(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        self.own("mul", &[a, b])?;
        let shape = broadcast_shape("mul", self.shape(a), self.shape(b))?;
        let mut y = self.take_for("mul", &shape)?;
        zip_into(&mut y, &shape, self.array(a), self.array(b), |x, y| x * y);
        Ok(self.put("mul", &[a, b], &shape, y, || Mul {
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
        of_two_values(|tape, a, b| tape.mul(a, b))
    }
}

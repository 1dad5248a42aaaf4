//! Sum of two values, and the core it shares with [`super::sub`].
//!
//! ```text
//! c = a + b, with a and b broadcast to c's shape;
//! dA = dC, dB = dC, summed over the broadcast axes.
//! ```

use super::broadcast::{add_reduced, broadcast_shape, zip_into};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Sum<T> {
    a: Var,
    b: Var,
    sign: T,
    shape: Vec<usize>,
}

impl<T: Real> Operation<T> for Sum<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        for (operand, sign) in [(self.a, T::one()), (self.b, self.sign)] {
            let shape = context.shape(operand);
            if let Some(target) = context.target(operand) {
                let gradient = dy.iter().map(|&d| d * sign);
                add_reduced(target, shape, &self.shape, gradient);
            }
        }
    }
}

/// a + sign b, for a sign of 1 or -1.
pub(super) fn signed_sum<T: Real>(
    tape: &mut Tape<'_, T>,
    name: &'static str,
    (a, b): (Var, Var),
    sign: T,
) -> Result<Var, AutogradError> {
    tape.own(name, &[a, b])?;
    let shape = broadcast_shape(name, tape.shape(a), tape.shape(b))?;
    let mut y = tape.take_for(name, &shape)?;
    let (left, right) = (tape.array(a), tape.array(b));
    zip_into(&mut y, &shape, left, right, |x, y| x + sign * y);
    Ok(tape.put(name, &[a, b], &shape, y, || Sum {
        a,
        b,
        sign,
        shape: shape.clone(),
    }))
}

impl<T: Real> Tape<'_, T> {
    /// a + b, elementwise with broadcasting.
    ///
    /// # Errors
    /// Shapes that do not broadcast together.
    pub fn add(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        signed_sum(self, "add", (a, b), T::one())
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_two_values};

    pub fn cases() -> Cases {
        of_two_values(|tape, a, b| tape.add(a, b))
    }
}

//! Difference of two values.
//!
//! ```text
//! c = a - b, with a and b broadcast to c's shape;
//! dA = dC, dB = -dC, summed over the broadcast axes.
//! ```

use super::add::signed_sum;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// a - b, elementwise with broadcasting.
    ///
    /// # Errors
    /// Shapes that do not broadcast together.
    pub fn sub(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        signed_sum(self, "sub", (a, b), -T::one())
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_two_values};

    pub fn cases() -> Cases {
        of_two_values(|tape, a, b| tape.sub(a, b))
    }
}

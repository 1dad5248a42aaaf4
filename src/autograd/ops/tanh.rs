//! Hyperbolic tangent.
//!
//! ```text
//! y = tanh(x); dX = dY * (1 - y^2).
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// tanh(x), elementwise.
    pub fn tanh(&mut self, x: Var) -> Var {
        unary(self, "tanh", x, T::tanh_slice, |_, y| T::one() - y * y)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.tanh(x)))
    }
}

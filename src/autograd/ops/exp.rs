//! Exponential.
//!
//! ```text
//! y = exp(x); dX = dY * y.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// exp(x), elementwise.
    pub fn exp(&mut self, x: Var) -> Var {
        unary(self, "exp", x, T::exp_slice, |_, y| y)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.exp(x)))
    }
}

//! Logistic function.
//!
//! ```text
//! y = 1 / (1 + exp(-x)); dX = dY * y * (1 - y).
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// 1 / (1 + exp(-x)), elementwise.
    pub fn sigmoid(&mut self, x: Var) -> Var {
        unary(self, "sigmoid", x, T::sigmoid_slice, |_, y| {
            y * (T::one() - y)
        })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.sigmoid(x)))
    }
}

//! Square.
//!
//! ```text
//! y = x^2; dX = dY * 2 x.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// x^2, elementwise.
    pub fn square(&mut self, x: Var) -> Var {
        unary(
            self,
            "square",
            x,
            |values| values.iter_mut().for_each(|x| *x = *x * *x),
            |x, _| x + x,
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.square(x)))
    }
}

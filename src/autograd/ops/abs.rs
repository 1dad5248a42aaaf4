//! Absolute value.
//!
//! ```text
//! y = |x|; dX = dY sign(x), 0 where x is 0.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// |x|, elementwise.
    pub fn abs(&mut self, x: Var) -> Var {
        unary(
            self,
            "abs",
            x,
            |values| values.iter_mut().for_each(|x| *x = x.abs()),
            |x, _| {
                if x > T::zero() {
                    T::one()
                } else if x < T::zero() {
                    -T::one()
                } else {
                    T::zero()
                }
            },
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.01, |tape, x| Ok(tape.abs(x)))
    }
}

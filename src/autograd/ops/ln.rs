//! Natural logarithm.
//!
//! ```text
//! y = ln(x); dX = dY / x.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// ln(x) for x > 0, elementwise.
    pub fn ln(&mut self, x: Var) -> Var {
        unary(
            self,
            "ln",
            x,
            |values| values.iter_mut().for_each(|x| *x = x.ln()),
            |x, _| T::one() / x,
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn(shapes(), |x, seed| {
            case(&[&x], seed, 0.0, |tape, v| {
                let square = tape.square(v[0]);
                let shift = tape.affine(square, 1.0, 0.3);
                Ok(tape.ln(shift))
            })
        })
    }
}

//! Scaling and shifting by constants.
//!
//! ```text
//! y = scale x + shift; dX = scale dY.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// scale x + shift, elementwise.
    pub fn affine(&mut self, x: Var, scale: f64, shift: f64) -> Var {
        let (scale, shift) = (T::from_f64(scale), T::from_f64(shift));
        unary(
            self,
            "affine",
            x,
            |values| values.iter_mut().for_each(|x| *x = *x * scale + shift),
            move |_, _| scale,
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        let inputs = (shapes(), -3.0..3.0, -3.0..3.0);
        drawn(inputs, |(x, scale, shift), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                Ok(tape.affine(v[0], scale, shift))
            })
        })
    }
}

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
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, shapes};

    pub fn cases() -> Cases {
        (shapes(), -3.0..3.0, -3.0..3.0, any::<u64>())
            .prop_map(|(x, scale, shift, seed)| {
                case(&[&x], seed, 0.0, move |tape, v| {
                    Ok(tape.affine(v[0], scale, shift))
                })
            })
            .boxed()
    }
}

//! Piecewise linear unit (Nicolae 2018, with its alpha = 0.1 and c = 1): the identity around 0,
//! flat beyond.
//!
//! ```text
//! y = max(alpha (x + c) - c, min(alpha (x - c) + c, x)); dX = dY where |x| < c, else alpha dY.
//! ```

use super::unary::unary;
use crate::autograd::kernels::vectorised;
use crate::autograd::{Real, Tape, Var};

const ALPHA: f64 = 0.1;
const C: f64 = 1.0;

impl<T: Real> Tape<'_, T> {
    /// x between -1 and 1, with slope 0.1 outside, elementwise.
    pub fn plu(&mut self, x: Var) -> Var {
        let (alpha, c) = (T::from_f64(ALPHA), T::from_f64(C));
        unary(
            self,
            "plu",
            x,
            |values| {
                vectorised(
                    #[inline(always)]
                    || {
                        for x in values {
                            if *x > c {
                                *x = alpha * (*x - c) + c;
                            } else if *x < -c {
                                *x = alpha * (*x + c) - c;
                            }
                        }
                    },
                );
            },
            move |x, _| {
                if x.abs() < c { T::one() } else { alpha }
            },
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    /// The numbers, which keep a margin from 0, are shifted so that the one kink or the other lies
    /// there.
    pub fn cases() -> Cases {
        drawn((shapes(), any::<bool>()), |(x, upper), seed| {
            let kink = if upper { super::C } else { -super::C };
            case(&[&x], seed, 0.01, move |tape, v| {
                // Halved, they stay clear of the other kink.
                let shifted = tape.affine(v[0], 0.5, kink);
                Ok(tape.plu(shifted))
            })
        })
    }
}

//! Clamping to an interval.
//!
//! ```text
//! y = min(max(x, low), high); dX = dY inside the interval, 0 outside.
//! ```

use super::unary::unary;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// x held between `low` and `high`, elementwise; a NaN stays one.
    pub fn clamp(&mut self, x: Var, low: f64, high: f64) -> Var {
        let expected = "at least the interval's low end";
        if let Err(error) = AutogradError::unless(low <= high, "clamp", ("high", high), expected) {
            return self.refuse(error);
        }
        let (low, high) = (T::from_f64(low), T::from_f64(high));
        let inside = move |x: T| {
            if x > low && x < high {
                T::one()
            } else {
                T::zero()
            }
        };
        unary(
            self,
            "clamp",
            x,
            |values| {
                for x in values {
                    if *x < low {
                        *x = low;
                    } else if *x > high {
                        *x = high;
                    }
                }
            },
            move |x, _| inside(x),
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    /// The interval's edges lie at 0 and beyond the drawn numbers, which keep a margin from 0.
    pub fn cases() -> Cases {
        drawn((shapes(), any::<bool>()), |(x, below), seed| {
            let (low, high) = if below { (-3.0, 0.0) } else { (0.0, 3.0) };
            case(&[&x], seed, 0.01, move |tape, v| {
                Ok(tape.clamp(v[0], low, high))
            })
        })
    }
}

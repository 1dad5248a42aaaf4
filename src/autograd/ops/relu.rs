//! Rectified linear unit.
//!
//! ```text
//! y = max(x, 0); dX = dY where x > 0, else 0.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// max(x, 0), elementwise.
    pub fn relu(&mut self, x: Var) -> Var {
        unary(
            self,
            "relu",
            x,
            |values| {
                values.iter_mut().for_each(|x| {
                    *x = if *x > T::zero() || x.is_nan() {
                        *x
                    } else {
                        T::zero()
                    }
                })
            },
            |x, _| if x > T::zero() { T::one() } else { T::zero() },
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, shapes};

    pub fn cases() -> Cases {
        (shapes(), any::<u64>())
            .prop_map(|(x, seed)| case(&[&x], seed, 0.01, |tape, v| Ok(tape.relu(v[0]))))
            .boxed()
    }
}

//! Hyperbolic tangent.
//!
//! ```text
//! y = tanh(x); dX = dY * (1 - y^2).
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// tanh(x), elementwise.
    pub fn tanh(&mut self, x: Var) -> Var {
        unary(self, "tanh", x, T::tanh_slice, |_, y| T::one() - y * y)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Case, case, shapes};

    pub fn cases() -> BoxedStrategy<Case> {
        (shapes(), any::<u64>())
            .prop_map(|(x, seed)| case(&[&x], seed, 0.0, |tape, v| Ok(tape.tanh(v[0]))))
            .boxed()
    }
}

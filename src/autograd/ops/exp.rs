//! Exponential.
//!
//! ```text
//! y = exp(x); dX = dY * y.
//! ```

use super::unary::unary;
use crate::autograd::{Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// exp(x), elementwise.
    pub fn exp(&mut self, x: Var) -> Var {
        unary(self, "exp", x, T::exp_slice, |_, y| y)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Case, case, shapes};

    pub fn cases() -> BoxedStrategy<Case> {
        (shapes(), any::<u64>())
            .prop_map(|(x, seed)| case(&[&x], seed, 0.0, |tape, v| Ok(tape.exp(v[0]))))
            .boxed()
    }
}

//! Residual add, dropout and layer norm in one: what stands behind each sublayer of a Transformer
//! (post-norm).
//!
//! y = layer_norm(residual + dropout(x)); formulas in [`super::layer_norm`].

use super::layer_norm::layer_norm;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// `layer_norm(residual + dropout(x, p))` with `gamma`, `beta [n]`; `x`, `residual [.., n]`.
    ///
    /// # Errors
    /// Shapes that do not fit; a probability that is none.
    pub fn add_layer_norm(
        &mut self,
        x: Var,
        residual: Var,
        (gamma, beta): (Var, Var),
        p: f64,
    ) -> Result<Var, AutogradError> {
        let name = "add_layer_norm";
        let dropout = self.next_draws(name, p)?;
        layer_norm(self, name, x, Some(residual), (gamma, beta), dropout)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    /// With and without dropout, and with one value as both summands.
    pub fn cases() -> Cases {
        let inputs = (0usize..4, 2usize..9, any::<[bool; 2]>());
        drawn(inputs, |(rows, n, [dropout, same]), seed| {
            let shapes: [&[usize]; 4] = [&[rows, n], &[rows, n], &[n], &[n]];
            case(&shapes, seed, 0.3, move |tape, v| {
                tape.set_dropout(dropout.then_some(seed));
                let residual = if same { v[0] } else { v[1] };
                tape.add_layer_norm(v[0], residual, (v[2], v[3]), 0.3)
            })
        })
    }
}

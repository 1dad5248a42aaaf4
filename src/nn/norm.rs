//! Layer norm, alone or behind a residual add.

use rand::Rng;

use super::Initialiser;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// Layer normalisation (eps 1e-5); `weight [n]` 1 and `bias [n]` 0 at first.
#[derive(Debug, Clone, Copy)]
pub struct LayerNorm {
    weight: BlockId,
    bias: BlockId,
}

impl LayerNorm {
    /// Adds `{name}.weight` and `{name}.bias`.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        width: usize,
    ) -> Self {
        Self {
            weight: init.constant(format!("{name}.weight"), &[width], 1.0).1,
            bias: init.constant(format!("{name}.bias"), &[width], 0.0).1,
        }
    }

    /// `norm(x)`, `[.., n]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn forward<T: Real>(&self, tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
        let (weight, bias) = (tape.block(self.weight), tape.block(self.bias));
        tape.layer_norm(x, weight, bias)
    }

    /// `norm(residual + dropout(x))`, all `[.., n]`.
    ///
    /// # Errors
    /// Inputs of other widths.
    pub fn after<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        residual: Var,
        dropout: f64,
    ) -> Result<Var, AutogradError> {
        let weights = (tape.block(self.weight), tape.block(self.bias));
        tape.add_layer_norm(x, residual, weights, dropout)
    }
}

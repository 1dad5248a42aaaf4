//! A fully connected layer.

use rand::Rng;

use super::Initialiser;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// y = x W^T + b; `weight [out, in]`, `bias [out]`, both uniform within 1 / sqrt(in) at first.
#[derive(Debug, Clone, Copy)]
pub struct Linear {
    pub weight: BlockId,
    pub bias: BlockId,
}

impl Linear {
    /// Adds `{name}.weight` and `{name}.bias`.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        inputs: usize,
        outputs: usize,
    ) -> Self {
        let bound = 1.0 / (inputs as f64).sqrt();
        Self {
            weight: init
                .uniform(format!("{name}.weight"), &[outputs, inputs], bound)
                .1,
            bias: init.uniform(format!("{name}.bias"), &[outputs], bound).1,
        }
    }

    /// [`Linear::new`], with 0 for every weight: whatever goes in, 0 comes out until it is trained.
    pub fn of_zeros<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        inputs: usize,
        outputs: usize,
    ) -> Self {
        Self {
            weight: init
                .constant(format!("{name}.weight"), &[outputs, inputs], 0.0)
                .1,
            bias: init.constant(format!("{name}.bias"), &[outputs], 0.0).1,
        }
    }

    /// `[.., in]` -> `[.., out]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn forward<T: Real>(&self, tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
        let (weight, bias) = (tape.block(self.weight), tape.block(self.bias));
        tape.linear(x, weight, Some(bias), false)
    }

    /// [`Linear::forward`], then ReLU.
    ///
    /// # Errors
    /// An input of another width.
    pub fn forward_relu<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
    ) -> Result<Var, AutogradError> {
        let (weight, bias) = (tape.block(self.weight), tape.block(self.bias));
        tape.linear(x, weight, Some(bias), true)
    }
}

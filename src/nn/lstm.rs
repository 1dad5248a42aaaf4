//! A recurrent layer of LSTM cells.

use rand::Rng;

use super::Initialiser;
use crate::autograd::ops::lstm_cell::LstmWeights;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// An LSTM layer; gates in the order i, f, g, o; all weights uniform within 1 / sqrt(H) at first.
#[derive(Debug, Clone, Copy)]
pub struct Lstm {
    weight_ih: BlockId,
    weight_hh: BlockId,
    bias_ih: BlockId,
    bias_hh: BlockId,
    hidden: usize,
}

impl Lstm {
    /// Adds `{name}.weight_ih_l0 [4H, in]`, `.weight_hh_l0 [4H, H]`, `.bias_ih_l0`,
    /// `.bias_hh_l0 [4H]`.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        inputs: usize,
        hidden: usize,
    ) -> Self {
        let bound = 1.0 / (hidden as f64).sqrt();
        let mut weight =
            |kind: &str, shape: &[usize]| init.uniform(format!("{name}.{kind}_l0"), shape, bound).1;
        Self {
            weight_ih: weight("weight_ih", &[4 * hidden, inputs]),
            weight_hh: weight("weight_hh", &[4 * hidden, hidden]),
            bias_ih: weight("bias_ih", &[4 * hidden]),
            bias_hh: weight("bias_hh", &[4 * hidden]),
            hidden,
        }
    }

    /// The state before the first step, zeros `[batch, 2H]`.
    pub fn start<T: Real>(&self, tape: &mut Tape<'_, T>, batch: usize) -> Var {
        tape.constant_with(&[batch, 2 * self.hidden], |state| state.fill(T::zero()))
    }

    /// One step: `x [batch, in]` and the state `[batch, 2H]` give the output `[batch, H]` and the
    /// new state.
    ///
    /// # Errors
    /// An input of another width or batch.
    pub fn step<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        state: Var,
    ) -> Result<(Var, Var), AutogradError> {
        let weights = LstmWeights {
            weight_ih: tape.block(self.weight_ih),
            weight_hh: tape.block(self.weight_hh),
            bias_ih: tape.block(self.bias_ih),
            bias_hh: tape.block(self.bias_hh),
        };
        let state = tape.lstm_cell(x, state, weights)?;
        let output = tape.columns(state, 0..self.hidden)?;
        Ok((output, state))
    }
}

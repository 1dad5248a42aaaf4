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
        Self::layer(init, name, 0, inputs, hidden)
    }

    /// [`Lstm::new`] as layer `layer` of several, `.weight_ih_l{layer}` and so on.
    pub fn layer<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        layer: usize,
        inputs: usize,
        hidden: usize,
    ) -> Self {
        let bound = 1.0 / (hidden as f64).sqrt();
        let mut weight = |kind: &str, shape: &[usize]| {
            let name = format!("{name}.{kind}_l{layer}");
            init.uniform(name, shape, bound).1
        };
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

    /// All steps of sequences, `inputs [frames * batch, n_i]` side by side, frame by frame, from a
    /// state `[batch, 2H]`: outputs `[frames * batch, H]` and the last state. What the inputs add
    /// to the gates is one product for all frames.
    ///
    /// # Errors
    /// Rows that are no whole frames; an input of another width.
    pub fn sequence<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        inputs: &[Var],
        state: Var,
    ) -> Result<(Var, Var), AutogradError> {
        let shape = inputs.first().map_or(&[][..], |&first| tape.shape(first));
        let batch = tape.shape(state).first().copied().unwrap_or(0);
        let rows = shape.first().copied().unwrap_or(0);
        if batch == 0 || !rows.is_multiple_of(batch) {
            return Err(AutogradError::Argument {
                operation: "lstm",
                shape: shape.to_vec(),
                argument: format!("{batch} sequences"),
                expected: "a row a frame and sequence",
            });
        }
        let (weight, bias) = (tape.block(self.weight_ih), tape.block(self.bias_ih));
        let of_inputs = tape.joined_linear(inputs, weight, bias)?;
        let (weight, bias) = (tape.block(self.weight_hh), tape.block(self.bias_hh));
        let mut state = state;
        let mut outputs = Vec::new();
        for frame in 0..rows / batch {
            let h = tape.columns(state, 0..self.hidden)?;
            let of_state = tape.linear(h, weight, Some(bias), false)?;
            let of_input = tape.rows(of_inputs, frame * batch..(frame + 1) * batch)?;
            let gates = tape.add(of_input, of_state)?;
            state = tape.lstm_gates(gates, state)?;
            outputs.push(tape.columns(state, 0..self.hidden)?);
        }
        let stacked = tape.stack(&outputs)?;
        Ok((tape.reshape(stacked, &[rows, self.hidden])?, state))
    }
}

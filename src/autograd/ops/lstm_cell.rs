//! One step of an LSTM, its four gates fused.
//!
//! ```text
//! x [B, in], state [B, 2H] = (h | c), W_ih [4H, in], W_hh [4H, H], b_ih, b_hh [4H]
//! -> new state [B, 2H]:
//! (i, f, g, o) = x W_ih^T + h W_hh^T + b_ih + b_hh, sigmoid on i, f, o and tanh on g;
//! c' = f c + i g, h' = o tanh(c').
//! ```

use super::linear::{bias_gradient, input_gradient};
use super::lstm_core::{Advanced, activate, advance, gates_gradient};
use super::shapes_error;
use crate::autograd::kernels::{Mat, MatMut};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

/// Weights of an LSTM cell on a tape, named and laid out as in PyTorch.
#[derive(Debug, Clone, Copy)]
pub struct LstmWeights {
    /// `[4H, in]`
    pub weight_ih: Var,
    /// `[4H, H]`
    pub weight_hh: Var,
    /// `[4H]`
    pub bias_ih: Var,
    /// `[4H]`
    pub bias_hh: Var,
}

struct LstmCell<T> {
    x: Var,
    state: Var,
    weights: LstmWeights,
    batch: usize,
    inputs: usize,
    hidden: usize,
    /// The gates after their functions, `[B, 4H]`.
    gates: Vec<T>,
}

impl<T: Real> Operation<T> for LstmCell<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (batch, n) = (self.batch, self.hidden);
        let before = context.values(self.state);
        let mut dgates = context.take(batch * 4 * n);
        let mut tanh_c = context.take(batch * n);
        let advanced = Advanced {
            gates: &self.gates,
            before,
            after: context.output(),
        };
        gates_gradient(advanced, dy, &mut dgates, &mut tanh_c, n);
        let w = self.weights;
        bias_gradient(context, w.bias_ih, &dgates);
        bias_gradient(context, w.bias_hh, &dgates);
        let d = Mat::new(&dgates, batch, 4 * n);
        let x = Mat::new(context.values(self.x), batch, self.inputs);
        context.weight_gradient(w.weight_ih, d, x);
        let h = Mat::new(before, batch, 2 * n).columns(0..n);
        context.weight_gradient(w.weight_hh, d, h);
        input_gradient(context, self.x, w.weight_ih, d);
        let known = context.known();
        if let Some(target) = context.target(self.state) {
            let fresh = target.fresh;
            let rows = target.data.chunks_exact_mut(2 * n);
            for (target, dy) in rows.zip(dy.chunks_exact(2 * n)) {
                let (target, dy) = (&mut target[n..], &dy[n..]);
                if fresh {
                    target.copy_from_slice(dy);
                } else {
                    target.iter_mut().zip(dy).for_each(|(t, &d)| *t += d);
                }
            }
            let dh = MatMut::new(target.data, batch, 2 * n).columns(0..n);
            known.product(d, w.weight_hh, dh, !fresh);
        }
        context.give(dgates);
        context.give(tanh_c);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.gates));
    }
}

impl<T: Real> Tape<'_, T> {
    /// One LSTM step: `x [B, in]` and `state [B, 2H]` (h beside c) give the new state `[B, 2H]`.
    ///
    /// # Errors
    /// Shapes that do not fit.
    pub fn lstm_cell(
        &mut self,
        x: Var,
        state: Var,
        weights: LstmWeights,
    ) -> Result<Var, AutogradError> {
        let LstmWeights {
            weight_ih,
            weight_hh,
            bias_ih,
            bias_hh,
        } = weights;
        let all = [x, state, weight_ih, weight_hh, bias_ih, bias_hh];
        self.own("lstm_cell", &all)?;
        let (left, right) = (self.shape(x), self.shape(state));
        let (batch, inputs, n) = match (left, right) {
            (&[batch, inputs], &[states, width])
                if states == batch && width > 0 && width.is_multiple_of(2) =>
            {
                (batch, inputs, width / 2)
            }
            _ => {
                let expected = "x [B, in] and state [B, 2H]";
                return Err(shapes_error("lstm_cell", left, right, expected));
            }
        };
        for (weight, wanted) in [
            (weight_ih, &[4 * n, inputs][..]),
            (weight_hh, &[4 * n, n][..]),
            (bias_ih, &[4 * n][..]),
            (bias_hh, &[4 * n][..]),
        ] {
            if self.shape(weight) != wanted {
                let expected = "weights [4H, in], [4H, H] and biases [4H]";
                let found = self.shape(weight);
                return Err(shapes_error("lstm_cell", wanted, found, expected));
            }
        }
        let mut gates = self.take(batch * 4 * n);
        let before = self.values(state);
        let x_matrix = Mat::new(self.values(x), batch, inputs);
        let h = Mat::new(before, batch, 2 * n).columns(0..n);
        for (weight, input, accumulate) in [(weight_ih, x_matrix, false), (weight_hh, h, true)] {
            let out = MatMut::new(&mut gates, batch, 4 * n);
            self.known()
                .product_transposed(input, weight, out, accumulate);
        }
        let (b_ih, b_hh) = (self.values(bias_ih), self.values(bias_hh));
        for row in gates.chunks_exact_mut(4 * n) {
            for ((gate, &a), &b) in row.iter_mut().zip(b_ih).zip(b_hh) {
                *gate += a + b;
            }
        }
        activate(&mut gates, n);
        let mut y = self.take(batch * 2 * n);
        advance(&gates, self.values(state), &mut y, n);
        if !self.is_recording() {
            self.give(std::mem::take(&mut gates));
        }
        let operation = || LstmCell {
            x,
            state,
            weights,
            batch,
            inputs,
            hidden: n,
            gates,
        };
        Ok(self.put("lstm_cell", &all, &[batch, 2 * n], y, operation))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use super::LstmWeights;
    use crate::autograd::check::property::{Cases, case, drawn, strength};

    /// Two steps through time, so that the state's gradient flows back and the weights' adds up;
    /// gates saturated and not.
    pub fn cases() -> Cases {
        let inputs = (0usize..3, 0usize..4, 1usize..3, strength());
        drawn(inputs, |(batch, inputs, n, strength), seed| {
            let shapes: [&[usize]; 6] = [
                &[batch, inputs],
                &[batch, 2 * n],
                &[4 * n, inputs],
                &[4 * n, n],
                &[4 * n],
                &[4 * n],
            ];
            case(&shapes, seed, 0.0, move |tape, v| {
                let x = tape.affine(v[0], strength, 0.0);
                let weights = LstmWeights {
                    weight_ih: v[2],
                    weight_hh: v[3],
                    bias_ih: v[4],
                    bias_hh: v[5],
                };
                let state = tape.lstm_cell(x, v[1], weights)?;
                tape.lstm_cell(x, state, weights)
            })
        })
    }
}

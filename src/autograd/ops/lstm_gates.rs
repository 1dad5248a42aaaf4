//! One step of an LSTM whose gates are there already, such as those of all frames at once and of
//! the state.
//!
//! ```text
//! gates [B, 4H] before their functions, state [B, 2H] = (h | c) -> new state [B, 2H]:
//! sigmoid on i, f, o and tanh on g; c' = f c + i g, h' = o tanh(c').
//! ```

use super::lstm_core::{Advanced, activate, advance, gates_gradient};
use super::shapes_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

struct LstmGates<T> {
    given: Var,
    state: Var,
    hidden: usize,
    /// The gates after their functions, `[B, 4H]`.
    gates: Vec<T>,
}

impl<T: Real> Operation<T> for LstmGates<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let n = self.hidden;
        let mut dgates = context.take(self.gates.len());
        let mut tanh_c = context.take(self.gates.len() / 4);
        let advanced = Advanced {
            gates: &self.gates,
            before: context.values(self.state),
            after: context.output(),
        };
        gates_gradient(advanced, dy, &mut dgates, &mut tanh_c, n);
        if let Some(target) = context.target(self.given) {
            target.add_values(&dgates);
        }
        if let Some(target) = context.target(self.state) {
            let rows = target.so_far().chunks_exact_mut(2 * n);
            for (target, dy) in rows.zip(dy.chunks_exact(2 * n)) {
                let pairs = target[n..].iter_mut().zip(&dy[n..]);
                pairs.for_each(|(target, &dc)| *target += dc);
            }
        }
        context.give(dgates);
        context.give(tanh_c);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.gates));
    }
}

impl<T: Real> Tape<'_, T> {
    /// One LSTM step by `gates [B, 4H]`, in the order i, f, g, o and before their functions: the
    /// `state [B, 2H]` (h beside c) becomes the new one, likewise. Of the old state only c counts.
    ///
    /// # Errors
    /// Shapes that do not fit.
    pub fn lstm_gates(&mut self, gates: Var, state: Var) -> Result<Var, AutogradError> {
        self.own("lstm_gates", &[gates, state])?;
        let (left, right) = (self.shape(gates), self.shape(state));
        let n = match (left, right) {
            (&[batch, wide], &[states, width])
                if states == batch && width > 0 && width.is_multiple_of(2) && wide == 2 * width =>
            {
                width / 2
            }
            _ => {
                let expected = "gates [B, 4H] and state [B, 2H]";
                return Err(shapes_error("lstm_gates", left, right, expected));
            }
        };
        let shape = right.to_vec();
        let (_, mut after) = self.copy(gates);
        activate(&mut after, n);
        let mut y = self.take(shape.iter().product());
        advance(&after, self.values(state), &mut y, n);
        if !self.is_recording() {
            self.give(std::mem::take(&mut after));
        }
        Ok(
            self.put("lstm_gates", &[gates, state], &shape, y, || LstmGates {
                given: gates,
                state,
                hidden: n,
                gates: after,
            }),
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, strength};

    /// Two steps, so that the state's gradient flows back; gates saturated and not.
    pub fn cases() -> Cases {
        let inputs = (0usize..3, 1usize..4, strength());
        drawn(inputs, |(batch, n, strength), seed| {
            let shapes: [&[usize]; 2] = [&[batch, 4 * n], &[batch, 2 * n]];
            case(&shapes, seed, 0.0, move |tape, v| {
                let gates = tape.affine(v[0], strength, 0.0);
                let state = tape.lstm_gates(gates, v[1])?;
                tape.lstm_gates(gates, state)
            })
        })
    }
}

//! A fully connected layer of several inputs side by side, some of which may want no gradient.
//!
//! ```text
//! x_i [.., n_i], x = (x_1 | x_2 | ..) [.., in], W [out, in], b [out] -> y [.., out] = x W^T + b;
//! dx_i = dY W_i for the columns W_i of x_i, dW = dY^T x, db = sum over rows of dY.
//! ```

use super::linear::{add_bias, bias_gradient};
use super::shapes_error;
use crate::autograd::kernels::{Mat, MatMut};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

struct JoinedLinear<T> {
    parts: Vec<Var>,
    weight: Var,
    bias: Var,
    /// `[rows, in]`
    joined: Vec<T>,
    rows: usize,
    inputs: usize,
    outputs: usize,
}

impl<T: Real> Operation<T> for JoinedLinear<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        bias_gradient(context, self.bias, dy);
        let dy = Mat::new(dy, self.rows, self.outputs);
        let joined = Mat::new(&self.joined, self.rows, self.inputs);
        context.weight_gradient(self.weight, dy, joined);
        let (known, mut start) = (context.known(), 0);
        for &part in &self.parts {
            let width = context.shape(part).last().copied().unwrap_or(1);
            if let Some(target) = context.target(part) {
                let dx = MatMut::new(target.data, self.rows, width);
                known.product_of_columns(dy, self.weight, start..start + width, dx, !target.fresh);
            }
            start += width;
        }
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.joined));
    }
}

impl<T: Real> Tape<'_, T> {
    /// `(x_1 | x_2 | ..) W^T + b` for the parts `x_i [.., n_i]`, `weight [out, n_1 + n_2 + ..]`
    /// and `bias [out]`, as `[.., out]`: what `concat` and `linear` give, but a part that wants no
    /// gradient costs none.
    ///
    /// # Errors
    /// As `concat` and `linear`: shapes that do not fit.
    pub fn joined_linear(
        &mut self,
        parts: &[Var],
        weight: Var,
        bias: Var,
    ) -> Result<Var, AutogradError> {
        const NAME: &str = "joined_linear";
        let all: Vec<Var> = parts.iter().copied().chain([weight, bias]).collect();
        self.own(NAME, &all)?;
        let (mut shape, mut joined) = self.join(NAME, parts)?;
        let inputs = shape.last().copied().unwrap_or(1);
        let rows = shape.iter().rev().skip(1).product();
        let right = self.shape(weight);
        let outputs = match *right {
            [outputs, columns] if columns == inputs => outputs,
            _ => {
                let expected = "x [.., in] and weight [out, in]";
                return Err(shapes_error(NAME, &shape, right, expected));
            }
        };
        if self.shape(bias) != [outputs] {
            let expected = "weight [out, in] and bias [out]";
            return Err(shapes_error(NAME, right, self.shape(bias), expected));
        }
        if let Some(last) = shape.last_mut() {
            *last = outputs;
        }
        let mut y = self.take_for(NAME, &shape)?;
        let out = MatMut::new(&mut y, rows, outputs);
        let x = Mat::new(&joined, rows, inputs);
        self.known().product_transposed(x, weight, out, false);
        add_bias(&mut y, Some(self.values(bias)), outputs, false);
        if !self.is_recording() {
            self.give(std::mem::take(&mut joined));
        }
        let parts = parts.to_vec();
        Ok(self.put(NAME, &all, &shape, y, || JoinedLinear {
            parts,
            weight,
            bias,
            joined,
            rows,
            inputs,
            outputs,
        }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    /// Three parts, the second a constant of the others' numbers where asked for; the layer is
    /// applied twice, so that gradients add up.
    pub fn cases() -> Cases {
        let inputs = ([0usize..4, 0..3, 0..4, 0..4], any::<bool>());
        drawn(inputs, |([rows, first, second, outputs], held), seed| {
            let shapes: [&[usize]; 4] = [
                &[rows, first],
                &[rows, second],
                &[outputs, first + second + first],
                &[outputs],
            ];
            case(&shapes, seed, 0.0, move |tape, v| {
                let middle = match held {
                    true => tape.constant(ndarray::Array2::ones((rows, second))),
                    false => v[1],
                };
                let once = tape.joined_linear(&[v[0], middle, v[0]], v[2], v[3])?;
                let twice = tape.joined_linear(&[v[0], v[1], v[0]], v[2], v[3])?;
                tape.mul(once, twice)
            })
        })
    }
}

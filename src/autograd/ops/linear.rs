//! A fully connected layer, with its bias and, where asked for, ReLU.
//!
//! ```text
//! x [.., in], W [out, in], b [out] -> y [.., out] = f(x W^T + b), f the identity or max(., 0);
//! with dZ = dY f': dX = dZ W, dW = dZ^T x, db = sum over rows of dZ.
//! ```

use super::shapes_error;
use crate::autograd::kernels::{Mat, MatMut, vectorised};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Linear {
    x: Var,
    weight: Var,
    bias: Option<Var>,
    relu: bool,
    rows: usize,
    inputs: usize,
    outputs: usize,
}

/// Adds the sums of the columns of `dy [rows, columns]` to the gradient of a bias.
pub(super) fn bias_gradient<T: Real>(context: &mut Backward<'_, T>, bias: Var, dy: &[T]) {
    let Some(target) = context.target(bias) else {
        return;
    };
    let data = target.so_far();
    if data.is_empty() {
        return;
    }
    vectorised(
        #[inline(always)]
        || {
            for dy in dy.chunks_exact(data.len()) {
                data.iter_mut().zip(dy).for_each(|(d, &dy)| *d += dy);
            }
        },
    );
}

/// dX (+)= dY W for W [out, in].
pub(super) fn input_gradient<T: Real>(
    context: &mut Backward<'_, T>,
    x: Var,
    weight: Var,
    dy: Mat<'_, T>,
) {
    let (known, inputs) = (context.known(), context.shape(weight)[1]);
    if let Some(target) = context.target(x) {
        let dx = MatMut::new(target.data, dy.rows, inputs);
        known.product(dy, weight, dx, !target.fresh);
    }
}

impl<T: Real> Operation<T> for Linear {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        if self.relu {
            let y = context.output();
            vectorised(
                #[inline(always)]
                || {
                    for (d, &y) in dy.iter_mut().zip(y) {
                        *d = if y > T::zero() { *d } else { T::zero() };
                    }
                },
            );
        }
        if let Some(bias) = self.bias {
            bias_gradient(context, bias, dy);
        }
        let dz = Mat::new(dy, self.rows, self.outputs);
        let x = Mat::new(context.values(self.x), self.rows, self.inputs);
        context.weight_gradient(self.weight, dz, x);
        input_gradient(context, self.x, self.weight, dz);
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x W^T + b` for `x [.., in]`, `weight [out, in]`, `bias [out]`, as `[.., out]`; `relu` sets
    /// negative numbers to 0.
    ///
    /// # Errors
    /// Shapes that do not fit.
    pub fn linear(
        &mut self,
        x: Var,
        weight: Var,
        bias: Option<Var>,
        relu: bool,
    ) -> Result<Var, AutogradError> {
        let mut all = vec![x, weight];
        all.extend(bias);
        self.own("linear", &all)?;
        let (rows, inputs) = self.rows_and_columns(x);
        let (left, right) = (self.shape(x), self.shape(weight));
        let outputs = match *right {
            [outputs, columns] if columns == inputs && !left.is_empty() => outputs,
            _ => {
                let expected = "x [.., in] and weight [out, in]";
                return Err(shapes_error("linear", left, right, expected));
            }
        };
        if let Some(bias) = bias
            && self.shape(bias) != [outputs]
        {
            let (left, right) = (self.shape(weight), self.shape(bias));
            let expected = "weight [out, in] and bias [out]";
            return Err(shapes_error("linear", left, right, expected));
        }
        let mut shape = left.to_vec();
        if let Some(last) = shape.last_mut() {
            *last = outputs;
        }
        let mut y = self.take_for("linear", &shape)?;
        let matrix = Mat::new(self.values(x), rows, inputs);
        let out = MatMut::new(&mut y, rows, outputs);
        self.known().product_transposed(matrix, weight, out, false);
        add_bias(&mut y, bias.map(|bias| self.values(bias)), outputs, relu);
        Ok(self.put("linear", &all, &shape, y, || Linear {
            x,
            weight,
            bias,
            relu,
            rows,
            inputs,
            outputs,
        }))
    }
}

pub(super) fn add_bias<T: Real>(y: &mut [T], bias: Option<&[T]>, outputs: usize, relu: bool) {
    if outputs == 0 || (bias.is_none() && !relu) {
        return;
    }
    vectorised(
        #[inline(always)]
        || {
            for y in y.chunks_exact_mut(outputs) {
                if let Some(bias) = bias {
                    y.iter_mut().zip(bias).for_each(|(y, &b)| *y += b);
                }
                if relu {
                    for y in y {
                        // Not `max`: a NaN must stay one.
                        *y = if *y < T::zero() { T::zero() } else { *y };
                    }
                }
            }
        },
    );
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    /// The layer is applied twice, so that its weight's gradient adds up.
    pub fn cases() -> Cases {
        let sizes = [0usize..4, 0..4, 0..4];
        let inputs = (sizes, any::<[bool; 2]>());
        drawn(inputs, |([rows, inputs, outputs], [bias, relu]), seed| {
            let (x, more): (&[usize], &[usize]) = (&[rows, inputs], &[2, 1, inputs]);
            let shapes: [&[usize]; 4] = [x, more, &[outputs, inputs], &[outputs]];
            case(&shapes, seed, 0.0, move |tape, v| {
                let bias = bias.then_some(v[3]);
                let first = tape.linear(v[0], v[2], bias, relu)?;
                let second = tape.linear(v[1], v[2], bias, relu)?;
                let second = tape.reshape(second, &[2, outputs])?;
                let (a, b) = (tape.sum(first), tape.square(second));
                tape.add(a, b)
            })
        })
    }
}

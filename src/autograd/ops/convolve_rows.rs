//! Convolution over time: each frame of a window with its neighbours.
//!
//! ```text
//! x [windows * frames, in], W [out, in, width], b [out] -> y [windows * frames, out]:
//! y_t = b + sum_w W[.., w] x_(t + w - half), width = 2 half + 1, x is 0 beyond a window's ends.
//! With the neighbours of a frame beside each other, c_t [in, width], it is a product with W as
//! [out, in * width]: dW = dY^T c, dC = dY W, dX_t = sum_w dC_(t - w + half)[.., w], db = sum over
//! rows of dY. c is gathered again on the way back.
//! ```

use super::linear::{add_bias, bias_gradient};
use super::{argument_error, shapes_error};
use crate::autograd::kernels::{Mat, MatMut};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct ConvolveRows {
    x: Var,
    weight: Var,
    bias: Var,
    taps: Taps,
    rows: usize,
    outputs: usize,
}

/// Which numbers of x stand in a row of c.
#[derive(Clone, Copy)]
struct Taps {
    frames: usize,
    inputs: usize,
    width: usize,
}

impl Taps {
    /// Numbers of a row of c.
    fn columns(self) -> usize {
        self.inputs * self.width
    }

    /// For a row: the places w within the window, each with its row of x.
    fn of_row(self, row: usize) -> impl Iterator<Item = (usize, usize)> {
        let (frame, half) = (row % self.frames, self.width / 2);
        let first = half.saturating_sub(frame);
        let last = self.width.min(self.frames - frame + half);
        (first..last).map(move |w| (w, row + w - half))
    }

    fn gather<T: Real>(self, x: &[T], c: &mut [T]) {
        if self.inputs == 0 {
            return;
        }
        for (row, c) in c.chunks_exact_mut(self.columns()).enumerate() {
            if self.of_row(row).count() < self.width {
                c.fill(T::zero());
            }
            for (w, from) in self.of_row(row) {
                let x = &x[from * self.inputs..][..self.inputs];
                for (c, &x) in c.chunks_exact_mut(self.width).zip(x) {
                    c[w] = x;
                }
            }
        }
    }

    /// Adds each number of `dc` to that of `dx` which it was gathered from.
    fn scatter<T: Real>(self, dc: &[T], dx: &mut [T]) {
        if self.inputs == 0 {
            return;
        }
        for (row, dc) in dc.chunks_exact(self.columns()).enumerate() {
            for (w, to) in self.of_row(row) {
                let dx = &mut dx[to * self.inputs..][..self.inputs];
                for (dx, dc) in dx.iter_mut().zip(dc.chunks_exact(self.width)) {
                    *dx += dc[w];
                }
            }
        }
    }
}

impl<T: Real> Operation<T> for ConvolveRows {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (taps, columns) = (self.taps, self.taps.columns());
        bias_gradient(context, self.bias, dy);
        let dy = Mat::new(&*dy, self.rows, self.outputs);
        let mut c = context.take(self.rows * columns);
        if context.needs_gradient(self.weight) {
            taps.gather(context.values(self.x), &mut c);
            let c = Mat::new(&c[..], self.rows, columns);
            context.weight_gradient(self.weight, dy, c);
        }
        if context.needs_gradient(self.x) {
            let dc = MatMut::new(&mut c[..], self.rows, columns);
            context.known().product(dy, self.weight, dc, false);
            if let Some(target) = context.target(self.x) {
                taps.scatter(&c, target.so_far());
            }
        }
        context.give(c);
    }
}

impl<T: Real> Tape<'_, T> {
    /// Convolution of `x [windows * frames, in]` over the frames of each window with
    /// `weight [out, in, width]` (the layout of PyTorch's `Conv1d`), plus `bias [out]`, as
    /// `[windows * frames, out]`. The width is odd; beyond a window's ends are zeros.
    ///
    /// # Errors
    /// Shapes that do not fit, an even width, rows that are no whole windows.
    pub fn convolve_rows(
        &mut self,
        x: Var,
        weight: Var,
        bias: Var,
        frames: usize,
    ) -> Result<Var, AutogradError> {
        let name = "convolve_rows";
        self.own(name, &[x, weight, bias])?;
        let (left, right) = (self.shape(x), self.shape(weight));
        let (rows, inputs, outputs, width) = match (left, right) {
            (&[rows, inputs], &[outputs, columns, width])
                if inputs == columns && !width.is_multiple_of(2) =>
            {
                (rows, inputs, outputs, width)
            }
            _ => {
                let expected = "x [rows, in] and weight [out, in, width], the width odd";
                return Err(shapes_error(name, left, right, expected));
            }
        };
        if self.shape(bias) != [outputs] {
            let expected = "weight [out, in, width] and bias [out]";
            return Err(shapes_error(name, right, self.shape(bias), expected));
        }
        if frames == 0 || !rows.is_multiple_of(frames) {
            let argument = format!("windows of {frames} frames");
            let expected = "[windows * frames, in]";
            return Err(argument_error(name, left, argument, expected));
        }
        let taps = Taps {
            frames,
            inputs,
            width,
        };
        let shape = [rows, outputs];
        let mut c = self.take_for(name, &[rows, inputs, width])?;
        let mut y = self.take_for(name, &shape)?;
        taps.gather(self.values(x), &mut c);
        let matrix = Mat::new(&c[..], rows, taps.columns());
        let out = MatMut::new(&mut y, rows, outputs);
        self.known().product_transposed(matrix, weight, out, false);
        add_bias(&mut y, Some(self.values(bias)), outputs, false);
        self.give(c);
        let operation = || ConvolveRows {
            x,
            weight,
            bias,
            taps,
            rows,
            outputs,
        };
        Ok(self.put(name, &[x, weight, bias], &shape, y, operation))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    /// Windows shorter than the width among them; applied twice, so that all gradients add up.
    pub fn cases() -> Cases {
        let sizes = [0usize..3, 1..5, 0..3, 0..3, 0..3];
        drawn(sizes, |[windows, frames, inputs, outputs, half], seed| {
            let rows = windows * frames;
            let weight = [outputs, inputs, 2 * half + 1];
            let shapes: [&[usize]; 3] = [&[rows, inputs], &weight, &[outputs]];
            case(&shapes, seed, 0.0, move |tape, v| {
                let first = tape.convolve_rows(v[0], v[1], v[2], frames)?;
                let second = tape.convolve_rows(v[0], v[1], v[2], rows.max(1))?;
                let second = tape.square(second);
                tape.add(first, second)
            })
        })
    }
}

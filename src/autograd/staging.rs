//! Rows collected for the gradient of a weight that is used at every time step.

use super::kernels::{Mat, MatMut, Real, product_at};
use super::workspace::Workspace;

/// From this many rows on a product is made at once: its cost then outweighs reading and writing
/// the gradient.
pub(super) const DIRECT_ROWS: usize = 96;
/// Collected rows that make a product.
const FULL_ROWS: usize = 512;

/// dy [rows, out] and x [rows, in] of several time steps, for one product dW += dy^T x.
pub(super) struct Staging<T> {
    outputs: usize,
    inputs: usize,
    rows: usize,
    dy: Vec<T>,
    x: Vec<T>,
}

impl<T: Real> Staging<T> {
    pub(super) fn new(outputs: usize, inputs: usize) -> Self {
        Self {
            outputs,
            inputs,
            rows: 0,
            dy: Vec::new(),
            x: Vec::new(),
        }
    }

    pub(super) fn push(&mut self, dy: Mat<'_, T>, x: Mat<'_, T>, workspace: &mut Workspace<T>) {
        if self.dy.is_empty() {
            self.dy = workspace.take((FULL_ROWS + DIRECT_ROWS) * self.outputs);
            self.x = workspace.take((FULL_ROWS + DIRECT_ROWS) * self.inputs);
        }
        copy_rows(dy, &mut self.dy[self.rows * self.outputs..]);
        copy_rows(x, &mut self.x[self.rows * self.inputs..]);
        self.rows += dy.rows;
    }

    pub(super) fn is_full(&self) -> bool {
        self.rows >= FULL_ROWS
    }

    pub(super) fn product_into(&self, gradient: &mut [T], accumulate: bool) {
        product_at(
            Mat::new(
                &self.dy[..self.rows * self.outputs],
                self.rows,
                self.outputs,
            ),
            Mat::new(&self.x[..self.rows * self.inputs], self.rows, self.inputs),
            MatMut::new(gradient, self.outputs, self.inputs),
            accumulate,
        );
    }

    pub(super) fn release(self, workspace: &mut Workspace<T>) {
        workspace.give(self.dy);
        workspace.give(self.x);
    }
}

fn copy_rows<T: Real>(from: Mat<'_, T>, to: &mut [T]) {
    for row in 0..from.rows {
        let start = row * from.stride;
        to[row * from.cols..(row + 1) * from.cols]
            .copy_from_slice(&from.data[start..start + from.cols]);
    }
}

//! The values on a tape as an operation reads them, on its way forth and back.

use std::ops::Range;

use ndarray::{ArrayViewD, IxDyn};

use super::{Node, Value, Var};
use crate::autograd::kernels::{Mat, MatMut, Real, product, product_bt, product_packed};
use crate::autograd::parameters::Parameters;

/// What is on a tape so far, for reading.
pub(in crate::autograd) struct Known<'s, T: Real> {
    pub(super) nodes: &'s [Node<T>],
    pub(super) parameters: &'s Parameters<T>,
}

impl<T: Real> Clone for Known<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real> Copy for Known<'_, T> {}

impl<'s, T: Real> Known<'s, T> {
    pub(super) fn shape(self, var: Var) -> &'s [usize] {
        self.nodes[var.index()].shape(self.parameters)
    }

    pub(super) fn values(self, var: Var) -> &'s [T] {
        self.values_at(var.index())
    }

    pub(super) fn values_at(self, index: usize) -> &'s [T] {
        match &self.nodes[index].value {
            // Every array on the tape is in standard layout.
            Value::Array(array) => array.as_slice().unwrap_or(&[]),
            Value::Block(id) => self.parameters.block_values(*id),
            Value::Released => &[],
        }
    }

    pub(super) fn array(self, var: Var) -> ArrayViewD<'s, T> {
        ArrayViewD::from_shape(IxDyn(self.shape(var)), self.values(var))
            .expect("a value has as many numbers as its shape says")
    }

    /// A weight `[out, in]`, or `[out, ..]` with the axes behind as one, as a matrix.
    fn matrix(self, weight: Var) -> Mat<'s, T> {
        let shape = self.shape(weight);
        let columns = shape[1..].iter().product();
        Mat::new(self.values(weight), shape[0], columns)
    }

    /// out (+)= x W for a weight W `[out, ..]`, packed where it is a parameter.
    pub(in crate::autograd) fn product(
        self,
        x: Mat<'_, T>,
        weight: Var,
        out: MatMut<'_, T>,
        accumulate: bool,
    ) {
        match self.nodes[weight.index()].value {
            Value::Block(id) => product_packed(x, self.parameters.packed(id), out, accumulate),
            _ => product(x, self.matrix(weight), out, accumulate),
        }
    }

    /// out (+)= x W for some columns of a weight W `[out, in]`.
    pub(in crate::autograd) fn product_of_columns(
        self,
        x: Mat<'_, T>,
        weight: Var,
        columns: Range<usize>,
        out: MatMut<'_, T>,
        accumulate: bool,
    ) {
        product(x, self.matrix(weight).columns(columns), out, accumulate);
    }

    /// out (+)= x W^T for a weight W `[out, ..]`, packed where it is a parameter.
    pub(in crate::autograd) fn product_transposed(
        self,
        x: Mat<'_, T>,
        weight: Var,
        out: MatMut<'_, T>,
        accumulate: bool,
    ) {
        match self.nodes[weight.index()].value {
            Value::Block(id) => {
                product_packed(x, self.parameters.packed_transposed(id), out, accumulate);
            }
            _ => product_bt(x, self.matrix(weight), out, accumulate),
        }
    }
}

//! Initial values of weights, drawn as PyTorch draws them by default.

use ndarray::{ArrayD, IxDyn};
use rand::{Rng, RngExt};

use crate::autograd::{BlockId, ParameterId, Parameters, Real};

/// Adds named parameters with initial values drawn from one stream.
pub struct Initialiser<'a, T, R> {
    parameters: &'a mut Parameters<T>,
    rng: R,
}

impl<'a, T: Real, R: Rng> Initialiser<'a, T, R> {
    pub fn new(parameters: &'a mut Parameters<T>, rng: R) -> Self {
        Self { parameters, rng }
    }

    /// Uniform between `-bound` and `bound`.
    pub fn uniform(&mut self, name: String, shape: &[usize], bound: f64) -> (ParameterId, BlockId) {
        let rng = &mut self.rng;
        let value = ArrayD::from_shape_simple_fn(IxDyn(shape), || {
            T::from_f64((2.0 * rng.random::<f64>() - 1.0) * bound)
        });
        self.parameters.add(name, value)
    }

    pub fn constant(
        &mut self,
        name: String,
        shape: &[usize],
        value: f64,
    ) -> (ParameterId, BlockId) {
        let value = ArrayD::from_elem(IxDyn(shape), T::from_f64(value));
        self.parameters.add(name, value)
    }

    /// A block of a parameter's rows.
    pub fn rows(&mut self, id: ParameterId, rows: std::ops::Range<usize>) -> BlockId {
        self.parameters.rows(id, rows)
    }
}

//! Initial values of weights, drawn as PyTorch draws them by default.

use std::ops::Range;

use ndarray::{ArrayD, IxDyn};
use rand::{Rng, RngExt};

use crate::autograd::{AutogradError, BlockId, BufferId, ParameterId, Parameters, Real};

/// Most weights that a model may have, 2 GiB in f32: sizes beyond are a mistake in a config, and
/// memory would end first.
pub const MOST_WEIGHTS: usize = 1 << 29;

/// Adds named parameters with initial values drawn from one stream.
///
/// ```
/// use keydance::autograd::Parameters;
/// use keydance::nn::{Initialiser, Linear};
/// use rand::SeedableRng as _;
///
/// let mut parameters = Parameters::<f32>::new();
/// let rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
/// let layer = Linear::new(&mut Initialiser::new(&mut parameters, rng), "layer", 3, 2);
/// let names: Vec<&str> = parameters.iter().map(|(name, _)| name).collect();
/// assert_eq!(names, ["layer.weight", "layer.bias"]);
/// ```
pub struct Initialiser<'a, T, R> {
    parameters: &'a mut Parameters<T>,
    rng: R,
    most: usize,
    added: usize,
}

impl<'a, T: Real, R: Rng> Initialiser<'a, T, R> {
    /// For a model of at most [`MOST_WEIGHTS`] weights.
    pub fn new(parameters: &'a mut Parameters<T>, rng: R) -> Self {
        Self::limited(parameters, rng, MOST_WEIGHTS)
    }

    /// For a model of at most `most` weights. What is added beyond is empty: sizes from a file that
    /// cannot be trusted take no memory.
    pub fn limited(parameters: &'a mut Parameters<T>, rng: R, most: usize) -> Self {
        Self {
            parameters,
            rng,
            most,
            added: 0,
        }
    }

    /// The limit, where more weights were asked for.
    pub fn exceeded(&self) -> Option<usize> {
        (self.added > self.most).then_some(self.most)
    }

    /// The shape where the limit allows it, else one of the same axes with nothing in it.
    fn admit(&mut self, shape: &[usize]) -> IxDyn {
        let weights = shape.iter().fold(1, |n: usize, &k| n.saturating_mul(k));
        self.added = self.added.saturating_add(weights);
        match self.exceeded() {
            None => IxDyn(shape),
            Some(_) => IxDyn(&vec![0; shape.len()]),
        }
    }

    /// Uniform between `-bound` and `bound`; 0 where that has no end, as for a layer without
    /// inputs.
    pub fn uniform(&mut self, name: String, shape: &[usize], bound: f64) -> (ParameterId, BlockId) {
        let shape = self.admit(shape);
        let bound = if bound.is_finite() { bound } else { 0.0 };
        let rng = &mut self.rng;
        let value = ArrayD::from_shape_simple_fn(shape, || {
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
        let value = ArrayD::from_elem(self.admit(shape), T::from_f64(value));
        self.parameters.add(name, value)
    }

    /// Values that `make` computes, where the limit allows them.
    pub fn made(
        &mut self,
        name: String,
        shape: &[usize],
        make: impl FnOnce(&mut R) -> ArrayD<T>,
    ) -> (ParameterId, BlockId) {
        let value = self.value(shape, make);
        self.parameters.add(name, value)
    }

    /// [`Initialiser::made`] for a [buffer](Initialiser::buffer).
    pub fn made_buffer(
        &mut self,
        name: String,
        shape: &[usize],
        make: impl FnOnce(&mut R) -> ArrayD<T>,
    ) -> BufferId {
        let value = self.value(shape, make);
        self.parameters.add_buffer(name, value)
    }

    fn value(&mut self, shape: &[usize], make: impl FnOnce(&mut R) -> ArrayD<T>) -> ArrayD<T> {
        let admitted = self.admit(shape);
        match self.exceeded() {
            None => make(&mut self.rng),
            Some(_) => ArrayD::from_elem(admitted, T::zero()),
        }
    }

    /// The parameters so far, such as to start some of them from data.
    pub fn parameters_mut(&mut self) -> &mut Parameters<T> {
        self.parameters
    }

    /// Weights that were asked for, of buffers, too, whether the limit allowed them or not.
    pub fn asked_for(&self) -> usize {
        self.added
    }

    /// A buffer, such as a running mean: saved with the weights, moved by no gradient.
    pub fn buffer(&mut self, name: String, shape: &[usize], value: f64) -> BufferId {
        let value = ArrayD::from_elem(self.admit(shape), T::from_f64(value));
        self.parameters.add_buffer(name, value)
    }

    /// A block of a parameter's rows.
    ///
    /// # Errors
    /// A parameter of other parameters.
    pub fn rows(&mut self, id: ParameterId, rows: Range<usize>) -> Result<BlockId, AutogradError> {
        self.parameters.rows(id, rows)
    }
}

//! Weights by name, blocks of their rows, and the gradients that a backward pass adds up.

use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};

use ndarray::{ArrayD, ArrayViewMutD};

use super::error::AutogradError;
use super::kernels::{Mat, Packed, Real, Repacked};

/// A parameter of a [`Parameters`] and of its clones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ParameterId {
    index: usize,
    owner: u32,
}

/// A range of rows of a parameter (all of them, or a part such as the keys' rows of
/// `in_proj_weight`): what a tape sees of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BlockId {
    pub(super) index: usize,
    owner: u32,
}

/// A buffer of a [`Parameters`] and of its clones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct BufferId {
    index: usize,
    owner: u32,
}

impl BufferId {
    /// Its place among the buffers of the parameters.
    pub fn place(self) -> usize {
        self.index
    }
}

#[derive(Debug, Clone)]
struct Parameter<T> {
    name: String,
    value: ArrayD<T>,
}

#[derive(Debug, Clone)]
struct Block<T> {
    parameter: usize,
    /// Numbers of the parameter that the block covers.
    range: Range<usize>,
    shape: Vec<usize>,
    /// The block as a right operand, W [out, in] and its transpose, packed when first used after an
    /// update.
    packed: Repacked<T>,
    packed_transposed: Repacked<T>,
}

/// Named weights, and named buffers: state that is saved with them and that no gradient moves, such
/// as running means. Shared read-only by the tapes of a step; changed between steps only.
///
/// ```
/// use keydance::autograd::Parameters;
///
/// let mut parameters = Parameters::<f32>::new();
/// let (_, weight) = parameters.add("weight", ndarray::Array2::zeros((2, 3)).into_dyn());
/// assert_eq!((parameters.len(), parameters.weights()), (1, 6));
/// ```
#[derive(Debug, Clone)]
pub struct Parameters<T> {
    /// What their ids have, too, and those of no others but clones.
    owner: u32,
    parameters: Vec<Parameter<T>>,
    blocks: Vec<Block<T>>,
    buffers: Vec<Parameter<T>>,
}

impl<T: Real> Default for Parameters<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T: Real> Parameters<T> {
    pub fn new() -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        Self {
            owner: NEXT.fetch_add(1, Ordering::Relaxed),
            parameters: Vec::new(),
            blocks: Vec::new(),
            buffers: Vec::new(),
        }
    }

    /// Adds a buffer.
    pub fn add_buffer(&mut self, name: impl Into<String>, value: ArrayD<T>) -> BufferId {
        self.buffers.push(Parameter {
            name: name.into(),
            value: value.as_standard_layout().into_owned(),
        });
        BufferId {
            index: self.buffers.len() - 1,
            owner: self.owner,
        }
    }

    /// The values of a buffer.
    ///
    /// # Errors
    /// A buffer of other parameters.
    pub fn buffer(&self, id: BufferId) -> Result<&ArrayD<T>, AutogradError> {
        let buffer = self.buffers.get(id.index);
        let own = buffer.filter(|_| id.owner == self.owner);
        Ok(&own.ok_or(foreign("buffer"))?.value)
    }

    /// The values of a buffer, to be changed.
    ///
    /// # Errors
    /// A buffer of other parameters.
    pub fn buffer_mut(&mut self, id: BufferId) -> Result<ArrayViewMutD<'_, T>, AutogradError> {
        let buffer = self.buffers.get_mut(id.index);
        let own = buffer.filter(|_| id.owner == self.owner);
        Ok(own.ok_or(foreign("buffer_mut"))?.value.view_mut())
    }

    /// The buffer at a place among them.
    pub fn buffer_at(&self, place: usize) -> Option<BufferId> {
        (place < self.buffers.len()).then_some(BufferId {
            index: place,
            owner: self.owner,
        })
    }

    /// Names and values of the buffers, in the order in which they were added.
    pub fn buffers(&self) -> impl Iterator<Item = (&str, &ArrayD<T>)> {
        self.buffers
            .iter()
            .map(|buffer| (buffer.name.as_str(), &buffer.value))
    }

    /// All that a weights file holds, to be changed: parameters, then buffers.
    pub fn saved_mut(&mut self) -> impl Iterator<Item = (&str, ArrayViewMutD<'_, T>)> {
        self.forget_packed();
        let saved = self.parameters.iter_mut().chain(&mut self.buffers);
        saved.map(|saved| (saved.name.as_str(), saved.value.view_mut()))
    }

    /// All that a weights file holds: parameters, then buffers.
    pub fn saved(&self) -> impl Iterator<Item = (&str, &ArrayD<T>)> {
        self.iter().chain(self.buffers())
    }

    /// Adds a parameter and the block that covers it whole.
    pub fn add(&mut self, name: impl Into<String>, value: ArrayD<T>) -> (ParameterId, BlockId) {
        let id = ParameterId {
            index: self.parameters.len(),
            owner: self.owner,
        };
        let value = value.as_standard_layout().into_owned();
        let (len, shape) = (value.len(), value.shape().to_vec());
        self.parameters.push(Parameter {
            name: name.into(),
            value,
        });
        (id, self.add_block(id, 0..len, shape))
    }

    /// The block of a parameter's rows in `rows` (clamped to the rows there are).
    ///
    /// # Errors
    /// A parameter of other parameters.
    pub fn rows(&mut self, id: ParameterId, rows: Range<usize>) -> Result<BlockId, AutogradError> {
        let parameter = self.parameters.get(id.index);
        let own = parameter.filter(|_| id.owner == self.owner);
        let value = &own.ok_or(foreign("rows"))?.value;
        let mut shape = value.shape().to_vec();
        let total = shape.first().copied().unwrap_or(1);
        let (start, end) = (rows.start.min(total), rows.end.min(total));
        let width = value.len() / total.max(1);
        if let Some(first) = shape.first_mut() {
            *first = end.saturating_sub(start);
        }
        Ok(self.add_block(id, start * width..end.max(start) * width, shape))
    }

    fn add_block(&mut self, id: ParameterId, range: Range<usize>, shape: Vec<usize>) -> BlockId {
        self.blocks.push(Block {
            parameter: id.index,
            range,
            shape,
            packed: Repacked::default(),
            packed_transposed: Repacked::default(),
        });
        BlockId {
            index: self.blocks.len() - 1,
            owner: self.owner,
        }
    }

    /// Refuses a block of other parameters.
    pub(super) fn check_block(&self, id: BlockId) -> Result<(), AutogradError> {
        match id.owner == self.owner && id.index < self.blocks.len() {
            true => Ok(()),
            false => Err(foreign("block")),
        }
    }

    /// Number of parameters (arrays).
    pub fn len(&self) -> usize {
        self.parameters.len()
    }

    pub fn is_empty(&self) -> bool {
        self.parameters.is_empty()
    }

    /// Number of weights in all parameters together.
    pub fn weights(&self) -> usize {
        self.parameters.iter().map(|p| p.value.len()).sum()
    }

    pub(super) fn blocks(&self) -> usize {
        self.blocks.len()
    }

    /// Names and values, in the order in which the parameters were added.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &ArrayD<T>)> {
        self.parameters
            .iter()
            .map(|parameter| (parameter.name.as_str(), &parameter.value))
    }

    /// The values one after another, to be changed; what was packed of them is forgotten.
    pub fn values_mut(&mut self) -> impl Iterator<Item = (&str, ArrayViewMutD<'_, T>)> {
        self.forget_packed();
        self.parameters
            .iter_mut()
            .map(|parameter| (parameter.name.as_str(), parameter.value.view_mut()))
    }

    fn forget_packed(&mut self) {
        for block in &mut self.blocks {
            block.packed.forget();
            block.packed_transposed.forget();
        }
    }

    pub(super) fn block_shape(&self, id: BlockId) -> &[usize] {
        &self.blocks[id.index].shape
    }

    pub(super) fn block_values(&self, id: BlockId) -> &[T] {
        let block = &self.blocks[id.index];
        let values = self.parameters[block.parameter]
            .value
            .as_slice()
            .unwrap_or(&[]);
        &values[block.range.clone()]
    }

    fn block_matrix(&self, id: BlockId) -> Mat<'_, T> {
        let shape = &self.blocks[id.index].shape;
        let rows = shape.first().copied().unwrap_or(1);
        let columns = shape.iter().skip(1).product();
        Mat::new(self.block_values(id), rows, columns)
    }

    /// The block W [out, in], packed as the right operand of `d y W`.
    pub(super) fn packed(&self, id: BlockId) -> &Packed<T> {
        self.blocks[id.index].packed.get(|| self.block_matrix(id))
    }

    /// The transpose of the block W [out, in], packed as the right operand of `x W^T`.
    pub(super) fn packed_transposed(&self, id: BlockId) -> &Packed<T> {
        self.blocks[id.index]
            .packed_transposed
            .get_transposed(|| self.block_matrix(id))
    }
}

fn foreign(operation: &'static str) -> AutogradError {
    let what = "what is asked for belongs to other parameters: an id is one of the Parameters \
                that gave it, and of their clones";
    AutogradError::Misplaced { operation, what }
}

/// Gradients of all parameters, in their order, each in the layout of its parameter.
#[derive(Debug, Clone, Default)]
pub struct Gradients<T> {
    values: Vec<Vec<T>>,
}

impl<T: Real> Gradients<T> {
    /// Zeros for every parameter.
    pub fn zeros(parameters: &Parameters<T>) -> Self {
        let zeros = |(_, value): (_, &ArrayD<T>)| vec![T::zero(); value.len()];
        Self {
            values: parameters.iter().map(zeros).collect(),
        }
    }

    pub fn set_zero(&mut self) {
        for values in &mut self.values {
            values.fill(T::zero());
        }
    }

    /// The gradients, one slice a parameter.
    pub fn iter(&self) -> impl Iterator<Item = &[T]> {
        self.values.iter().map(Vec::as_slice)
    }

    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        self.values.iter_mut().map(Vec::as_mut_slice)
    }

    /// Whether there is a number for each weight of `parameters`.
    pub fn fit(&self, parameters: &Parameters<T>) -> bool {
        let lengths = parameters.iter().map(|(_, value)| value.len());
        lengths.eq(self.values.iter().map(Vec::len))
    }

    pub(super) fn block(&self, parameters: &Parameters<T>, id: BlockId) -> &[T] {
        let block = &parameters.blocks[id.index];
        &self.values[block.parameter][block.range.clone()]
    }

    pub(super) fn block_mut(&mut self, parameters: &Parameters<T>, id: BlockId) -> &mut [T] {
        let block = &parameters.blocks[id.index];
        &mut self.values[block.parameter][block.range.clone()]
    }
}

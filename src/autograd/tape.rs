//! The tape: values in the order in which they were made.

use std::sync::atomic::{AtomicU32, Ordering};

use ndarray::{Array, ArrayD, ArrayViewD, Dimension, IxDyn, aview1};

use super::error::AutogradError;
use super::kernels::Real;
use super::parameters::{BlockId, BufferId, Parameters};
use super::staging::Staging;
use super::workspace::Workspace;

mod backward;
mod known;

pub use backward::{Backward, Target};
use known::Known;

/// A value on a tape; every other tape refuses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Var {
    index: u32,
    stamp: u32,
}

impl Var {
    /// What an operation gives that was refused: a value of no tape.
    const NONE: Self = Self {
        index: u32::MAX,
        stamp: u32::MAX,
    };

    fn index(self) -> usize {
        self.index as usize
    }
}

/// A number that no value has yet: a tape has one of its own, and another once it forgot values.
fn new_stamp() -> u32 {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

macro_rules! elsewhere {
    ($operand:literal) => {
        concat!(
            $operand,
            " is not on this tape: it was made on another, or is forgotten; make it on this one, ",
            "or give its numbers to Tape::constant"
        )
    };
}

/// What is said of an operand that is not on the tape, by its place.
const ELSEWHERE: [&str; 4] = [
    elsewhere!("its first operand"),
    elsewhere!("its second operand"),
    elsewhere!("its third operand"),
    elsewhere!("a later operand"),
];

/// What a recorded operation knows for its way back.
pub trait Operation<T: Real>: Send {
    /// Adds to the gradients of the inputs what follows from `dy`, the gradient of the output (in
    /// the output's layout). `dy` may be overwritten.
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>);

    /// Gives the operation's own buffers back when its way back is done, or when the tape ends
    /// without one.
    fn release(&mut self, _workspace: &mut Workspace<T>) {}
}

enum Value<T> {
    Array(ArrayD<T>),
    Block(BlockId),
    /// Given back after its last use on the way back.
    Released,
}

struct Node<T> {
    name: &'static str,
    /// That of the [`Var`]s which name it.
    stamp: u32,
    value: Value<T>,
    inputs: Vec<Var>,
    needs_gradient: bool,
    operation: Option<Box<dyn Operation<T>>>,
}

impl<T: Real> Node<T> {
    fn shape<'s>(&'s self, parameters: &'s Parameters<T>) -> &'s [usize] {
        match &self.value {
            Value::Array(array) => array.shape(),
            Value::Block(id) => parameters.block_shape(*id),
            Value::Released => &[],
        }
    }
}

/// The lists of a tape, which outlive it empty in its workspace.
#[derive(Default)]
pub(super) struct Lists<T: Real> {
    nodes: Vec<Node<T>>,
    leaves: Vec<Option<Var>>,
    slots: Vec<Option<Vec<T>>>,
    stagings: Vec<Option<Staging<T>>>,
}

/// A tape. Operations are methods, one file each in [`super::ops`]; the values stay until the tape
/// ends or [`Tape::forget_since`].
///
/// Each method borrows the tape: name what it gives, `let y = ..`, before the next takes it.
///
/// A method that returns no `Result` and is asked for what it cannot do gives a value of no tape:
/// whatever is then asked of that, the way back included, fails with the reason, and there is
/// nothing to read in it.
///
/// ```
/// use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
///
/// let (parameters, mut workspace) = (Parameters::<f64>::new(), Workspace::new());
/// let mut tape = Tape::recording(&parameters, &mut workspace);
/// let x = tape.input(ndarray::arr1(&[1.0, 2.0]));
/// let y = tape.square(x);
/// let mut gradients = Gradients::zeros(&parameters);
/// let of_x = tape.backward_from(y, &[1.0, 10.0], &[x], &mut gradients)?.remove(0);
/// assert_eq!(of_x, ndarray::arr1(&[2.0, 40.0]).into_dyn());
/// # Ok::<(), keydance::autograd::AutogradError>(())
/// ```
pub struct Tape<'a, T: Real> {
    parameters: &'a Parameters<T>,
    workspace: &'a mut Workspace<T>,
    nodes: Vec<Node<T>>,
    leaves: Vec<Option<Var>>,
    /// That of the values to come.
    stamp: u32,
    recording: bool,
    frozen: bool,
    dropout_key: Option<u64>,
    trace: bool,
    /// Why [`Var::NONE`] was given first.
    refused: Option<AutogradError>,
}

impl<'a, T: Real> Tape<'a, T> {
    /// A tape that records, to be run backwards.
    pub fn recording(parameters: &'a Parameters<T>, workspace: &'a mut Workspace<T>) -> Self {
        let lists = workspace.lists();
        let nodes = std::mem::take(&mut lists.nodes);
        let mut leaves = std::mem::take(&mut lists.leaves);
        leaves.resize(parameters.blocks(), None);
        Self {
            leaves,
            parameters,
            workspace,
            nodes,
            stamp: new_stamp(),
            recording: true,
            frozen: false,
            dropout_key: None,
            trace: false,
            refused: None,
        }
    }

    /// A tape that computes only: operations keep nothing for a way back.
    pub fn inference(parameters: &'a Parameters<T>, workspace: &'a mut Workspace<T>) -> Self {
        let mut tape = Self::recording(parameters, workspace);
        tape.recording = false;
        tape
    }

    /// Turns dropout and noise on; all masks and draws follow from this key and the order of the
    /// operations.
    pub fn with_dropout(mut self, key: u64) -> Self {
        self.set_dropout(Some(key));
        self
    }

    /// Turns dropout and noise on with a key, or off, for the operations that follow.
    pub fn set_dropout(&mut self, key: Option<u64>) {
        self.dropout_key = key;
    }

    /// Makes [`Tape::backward`] look for the first operation that makes a gradient of its inputs,
    /// weights among them, that is not finite (slow: for finding the cause).
    pub fn with_trace(mut self) -> Self {
        self.trace = true;
        self
    }

    pub fn is_recording(&self) -> bool {
        self.recording
    }

    /// A key for the draws of the next operation beside the probability `p` of its dropout, where
    /// dropout is on and that above 0.
    ///
    /// # Errors
    /// A probability that is none.
    pub(super) fn next_draws(
        &self,
        operation: &'static str,
        p: f64,
    ) -> Result<Option<(u64, f64)>, AutogradError> {
        let (valid, expected) = ((0.0..=1.0).contains(&p), "a probability, from 0 to 1");
        AutogradError::unless(valid, operation, ("p", p), expected)?;
        Ok(self.next_key(p))
    }

    /// A key for the draws of the next operation beside their `strength`, where dropout is on and
    /// that above 0.
    pub(super) fn next_key(&self, strength: f64) -> Option<(u64, f64)> {
        let key = self.dropout_key.filter(|_| strength > 0.0);
        key.map(|key| {
            let mut x = key ^ (self.nodes.len() as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (x ^ (x >> 31), strength)
        })
    }

    /// A value that is given and wants no gradient.
    pub fn constant<D: Dimension>(&mut self, value: Array<T, D>) -> Var {
        self.leaf("constant", value.into_dyn(), false)
    }

    /// A constant of the given shape in a reused buffer that `fill` writes, all of it.
    pub fn constant_with(&mut self, shape: &[usize], fill: impl FnOnce(&mut [T])) -> Var {
        match self.take_for("constant", shape) {
            Ok(mut buffer) => {
                fill(&mut buffer);
                self.push("constant", &[], shape, buffer, false, None)
            }
            Err(error) => self.refuse(error),
        }
    }

    /// The numbers of `x` as a constant: no gradient goes back through it.
    pub fn detach(&mut self, x: Var) -> Var {
        if let Err(error) = self.own("detach", &[x]) {
            return self.refuse(error);
        }
        let (shape, buffer) = self.copy(x);
        self.push("detach", &[x], &shape, buffer, false, None)
    }

    /// A value that is given and wants a gradient of its own, see [`Tape::backward_from`].
    pub fn input<D: Dimension>(&mut self, value: Array<T, D>) -> Var {
        self.leaf("input", value.into_dyn(), true)
    }

    fn leaf(&mut self, name: &'static str, value: ArrayD<T>, needs_gradient: bool) -> Var {
        let value = if value.is_standard_layout() {
            value
        } else {
            value.as_standard_layout().into_owned()
        };
        self.node(name, Value::Array(value), &[], needs_gradient, None)
    }

    /// Builds with all parameters held: gradients go back through what `build` computes of them,
    /// but none to the parameters.
    pub fn frozen<R>(&mut self, build: impl FnOnce(&mut Self) -> R) -> R {
        let before = std::mem::replace(&mut self.frozen, true);
        let result = build(self);
        self.frozen = before;
        result
    }

    /// A block of a parameter, the same value however often it is asked for; inside
    /// [`Tape::frozen`] a constant.
    pub fn block(&mut self, id: BlockId) -> Var {
        if let Err(error) = self.parameters.check_block(id) {
            return self.refuse(error);
        }
        if let Some(var) = self.leaves[id.index].filter(|_| !self.frozen) {
            return var;
        }
        let needs_gradient = !self.frozen;
        let var = self.node("parameter", Value::Block(id), &[], needs_gradient, None);
        if !self.frozen {
            self.leaves[id.index] = Some(var);
        }
        var
    }

    /// `[0]` for a value of another tape.
    pub fn shape(&self, var: Var) -> &[usize] {
        match self.has(var) {
            true => self.known().shape(var),
            false => &[0],
        }
    }

    /// The numbers of a value in row-major order; none for one of another tape.
    pub fn values(&self, var: Var) -> &[T] {
        match self.has(var) {
            true => self.known().values(var),
            false => &[],
        }
    }

    /// A value as an array, `[0]` for one of another tape.
    pub fn array(&self, var: Var) -> ArrayViewD<'_, T> {
        match self.has(var) {
            true => self.known().array(var),
            false => aview1(&[]).into_dyn(),
        }
    }

    fn has(&self, var: Var) -> bool {
        let node = self.nodes.get(var.index());
        node.is_some_and(|node| node.stamp == var.stamp)
    }

    /// Refuses operands that are not on this tape. An operation that compares shapes before
    /// [`Tape::record`] begins with it, else its error is about the shape `[0]`.
    ///
    /// # Errors
    /// An operand of another tape, or one that was forgotten.
    pub fn own(&self, operation: &'static str, vars: &[Var]) -> Result<(), AutogradError> {
        match vars.iter().position(|&var| !self.has(var)) {
            None => Ok(()),
            Some(place) => {
                let what = ELSEWHERE[place.min(ELSEWHERE.len() - 1)];
                let refused = self.refused.clone().filter(|_| vars[place] == Var::NONE);
                Err(refused.unwrap_or(AutogradError::Misplaced { operation, what }))
            }
        }
    }

    /// Keeps why an operation gives no value.
    pub(super) fn refuse(&mut self, error: AutogradError) -> Var {
        self.refused.get_or_insert(error);
        Var::NONE
    }

    /// Rows and columns of a value seen as a matrix: the last axis, and all before it.
    pub(super) fn rows_and_columns(&self, var: Var) -> (usize, usize) {
        let shape = self.known().shape(var);
        let columns = shape.last().copied().unwrap_or(1);
        (shape.iter().rev().skip(1).product(), columns)
    }

    pub(super) fn needs_gradient(&self, var: Var) -> bool {
        self.nodes[var.index()].needs_gradient
    }

    /// A buffer for an operation's output or for what it saves, content undefined.
    pub(super) fn take(&mut self, len: usize) -> Vec<T> {
        self.workspace.take(len)
    }

    /// The same for an output of this shape, which may be larger than its operands together.
    pub(super) fn take_for(
        &mut self,
        operation: &'static str,
        shape: &[usize],
    ) -> Result<Vec<T>, AutogradError> {
        // Axes of 0 count as 1, as they do for ndarray.
        let numbers = shape.iter().filter(|&&n| n > 0);
        let bytes = numbers.fold(size_of::<T>(), |bytes, &n| bytes.saturating_mul(n));
        let buffer = match bytes <= isize::MAX as usize {
            true => self.workspace.try_take(shape.iter().product()),
            false => None,
        };
        buffer.ok_or_else(|| AutogradError::Argument {
            operation,
            shape: shape.to_vec(),
            argument: "the memory".into(),
            expected: "fewer numbers",
        })
    }

    /// Shape and numbers of a value, in a buffer of their own.
    pub(super) fn copy(&mut self, var: Var) -> (Vec<usize>, Vec<T>) {
        let mut buffer = self.take(self.known().values(var).len());
        buffer.copy_from_slice(self.known().values(var));
        (self.known().shape(var).to_vec(), buffer)
    }

    pub(super) fn give(&mut self, buffer: Vec<T>) {
        self.workspace.give(buffer);
    }

    pub(super) fn known(&self) -> Known<'_, T> {
        Known {
            nodes: &self.nodes,
            parameters: self.parameters,
        }
    }

    /// Puts the output of an operation of one's own on the tape: `name` for errors, the `inputs`
    /// that it was computed from, and the way back, which is asked for only where one is wanted.
    ///
    /// `examples/custom_operation.rs` is a whole one, with the property check of its gradient. One
    /// of several operands asks [`Tape::own`] before it compares them.
    ///
    /// # Errors
    /// An input of another tape.
    pub fn record<D: Dimension, O: Operation<T> + 'static>(
        &mut self,
        name: &'static str,
        inputs: &[Var],
        output: Array<T, D>,
        operation: impl FnOnce() -> O,
    ) -> Result<Var, AutogradError> {
        self.own(name, inputs)?;
        let numbers = output.iter().copied().collect();
        Ok(self.put(name, inputs, output.shape(), numbers, operation))
    }

    /// [`Tape::record`] for operands that are known to be on the tape, and numbers in row-major
    /// order.
    pub(super) fn put<O: Operation<T> + 'static>(
        &mut self,
        name: &'static str,
        inputs: &[Var],
        shape: &[usize],
        output: Vec<T>,
        operation: impl FnOnce() -> O,
    ) -> Var {
        // An output without numbers sends no gradient back.
        let needs_gradient =
            self.recording && !output.is_empty() && inputs.iter().any(|&v| self.needs_gradient(v));
        let operation = needs_gradient.then(|| -> Box<dyn Operation<T>> { Box::new(operation()) });
        self.push(name, inputs, shape, output, needs_gradient, operation)
    }

    fn push(
        &mut self,
        name: &'static str,
        inputs: &[Var],
        shape: &[usize],
        output: Vec<T>,
        needs_gradient: bool,
        operation: Option<Box<dyn Operation<T>>>,
    ) -> Var {
        debug_assert_eq!(output.len(), shape.iter().product::<usize>(), "{name}");
        let array = ArrayD::from_shape_vec(IxDyn(shape), output)
            .expect("an operation's output has as many numbers as its shape says");
        self.node(name, Value::Array(array), inputs, needs_gradient, operation)
    }

    /// Puts a value on the tape; what only a way back needs is kept where there may be one.
    fn node(
        &mut self,
        name: &'static str,
        value: Value<T>,
        inputs: &[Var],
        needs_gradient: bool,
        operation: Option<Box<dyn Operation<T>>>,
    ) -> Var {
        let inputs = if self.recording { inputs } else { &[] };
        let (index, stamp) = (self.nodes.len() as u32, self.stamp);
        self.nodes.push(Node {
            name,
            stamp,
            value,
            inputs: inputs.to_vec(),
            needs_gradient: needs_gradient && self.recording,
            operation,
        });
        Var { index, stamp }
    }

    /// A place on the tape, see [`Tape::forget_since`].
    pub fn mark(&self) -> usize {
        self.nodes.len()
    }

    /// Without recording: drops every value made since `mark` but those in `keep`, which are
    /// renamed in place. So a long generation needs the memory of one frame.
    pub fn forget_since(&mut self, mark: usize, keep: &mut [&mut Var]) {
        for var in keep.iter_mut() {
            if let Err(error) = self.own("forget_since", &[**var]) {
                **var = self.refuse(error);
            }
        }
        if self.recording {
            return;
        }
        self.stamp = new_stamp();
        let mut renamed: Vec<(Var, Var)> = Vec::new();
        let mark = mark.min(self.nodes.len());
        let mut end = mark;
        for index in mark..self.nodes.len() {
            let wanted = keep.iter().any(|var| var.index() == index);
            if wanted || matches!(self.nodes[index].value, Value::Block(_)) {
                self.nodes.swap(end, index);
                let (node, place) = (&mut self.nodes[end], end as u32);
                let old = Var {
                    index: index as u32,
                    stamp: node.stamp,
                };
                // Where it moved, what stood there before it was named likewise.
                if end != index {
                    node.stamp = self.stamp;
                }
                let new = Var {
                    index: place,
                    stamp: node.stamp,
                };
                if let Value::Block(id) = node.value {
                    self.leaves[id.index] = Some(new);
                }
                renamed.push((old, new));
                end += 1;
            }
        }
        for mut node in self.nodes.drain(end..) {
            release(&mut node, self.workspace);
        }
        for var in keep.iter_mut() {
            if let Some((_, new)) = renamed.iter().find(|(old, _)| old == *var) {
                **var = *new;
            }
        }
    }

    /// The first value on the tape that is not finite, as an error that names its operation; before
    /// that, an operation that was refused.
    pub fn check_finite(&self) -> Result<(), AutogradError> {
        if let Some(refused) = &self.refused {
            return Err(refused.clone());
        }
        for (index, node) in self.nodes.iter().enumerate() {
            if let Value::Array(array) = &node.value
                && let Some(what) = array.as_slice().and_then(not_finite)
            {
                return Err(self.non_finite(index, what, "value"));
            }
        }
        Ok(())
    }

    fn non_finite(&self, index: usize, what: &'static str, place: &'static str) -> AutogradError {
        let node = &self.nodes[index];
        AutogradError::NonFinite {
            operation: node.name,
            index,
            what,
            place,
            shape: node.shape(self.parameters).to_vec(),
            inputs: node
                .inputs
                .iter()
                .map(|&v| self.known().shape(v).to_vec())
                .collect(),
        }
    }

    /// The values of a buffer, such as a running mean; on the tape they are a constant like any
    /// other.
    ///
    /// # Errors
    /// A buffer of other parameters than the tape's.
    pub fn buffer(&self, id: BufferId) -> Result<&ArrayD<T>, AutogradError> {
        self.parameters.buffer(id)
    }
}

impl<T: Real> Drop for Tape<'_, T> {
    fn drop(&mut self) {
        for mut node in self.nodes.drain(..) {
            release(&mut node, self.workspace);
        }
        self.leaves.clear();
        let lists = self.workspace.lists();
        lists.nodes = std::mem::take(&mut self.nodes);
        lists.leaves = std::mem::take(&mut self.leaves);
    }
}

fn release<T: Real>(node: &mut Node<T>, workspace: &mut Workspace<T>) {
    if let Some(mut operation) = node.operation.take() {
        operation.release(workspace);
    }
    if let Value::Array(array) = std::mem::replace(&mut node.value, Value::Released) {
        workspace.give(array.into_raw_vec_and_offset().0);
    }
}

fn not_finite<T: Real>(values: &[T]) -> Option<&'static str> {
    values
        .iter()
        .find(|x| !x.is_finite())
        .map(|x| if x.is_nan() { "NaN" } else { "infinity" })
}

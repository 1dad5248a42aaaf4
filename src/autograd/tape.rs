//! The tape: values in the order in which they were made, and the way back through them.

use ndarray::{ArrayD, ArrayViewD, IxDyn};

use super::error::AutogradError;
use super::kernels::{
    Mat, MatMut, Real, product, product_at, product_bt, product_packed, vectorised,
};
use super::parameters::{BlockId, Gradients, Parameters};
use super::staging::{DIRECT_ROWS, Staging};
use super::workspace::Workspace;

/// A value on a tape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Var(u32);

impl Var {
    fn index(self) -> usize {
        self.0 as usize
    }
}

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
    value: Value<T>,
    inputs: Vec<Var>,
    needs_gradient: bool,
    operation: Option<Box<dyn Operation<T>>>,
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
pub struct Tape<'a, T: Real> {
    parameters: &'a Parameters<T>,
    workspace: &'a mut Workspace<T>,
    nodes: Vec<Node<T>>,
    leaves: Vec<Option<Var>>,
    recording: bool,
    frozen: bool,
    dropout_key: Option<u64>,
    trace: bool,
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
            recording: true,
            frozen: false,
            dropout_key: None,
            trace: false,
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

    /// A key for the draws of the next operation beside their `strength`, where dropout is on and
    /// that above 0.
    pub(super) fn next_draws(&self, strength: f64) -> Option<(u64, f64)> {
        let key = self.dropout_key.filter(|_| strength > 0.0);
        key.map(|key| {
            let mut x = key ^ (self.nodes.len() as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (x ^ (x >> 31), strength)
        })
    }

    /// A value that is given and wants no gradient.
    pub fn constant(&mut self, value: ArrayD<T>) -> Var {
        self.leaf("constant", value, false)
    }

    /// A constant of the given shape in a reused buffer that `fill` writes, all of it.
    pub fn constant_with(&mut self, shape: &[usize], fill: impl FnOnce(&mut [T])) -> Var {
        let mut buffer = self.workspace.take(shape.iter().product());
        fill(&mut buffer);
        self.push("constant", &[], shape, buffer, false, None)
    }

    /// The numbers of `x` as a constant: no gradient goes back through it.
    pub fn detach(&mut self, x: Var) -> Var {
        let shape = self.shape(x).to_vec();
        let mut buffer = self.workspace.take(self.values(x).len());
        buffer.copy_from_slice(self.values(x));
        self.push("detach", &[x], &shape, buffer, false, None)
    }

    /// A value that is given and wants a gradient of its own, see [`Tape::backward_from`].
    pub fn input(&mut self, value: ArrayD<T>) -> Var {
        self.leaf("input", value, true)
    }

    fn leaf(&mut self, name: &'static str, value: ArrayD<T>, needs_gradient: bool) -> Var {
        let value = if value.is_standard_layout() {
            value
        } else {
            value.as_standard_layout().into_owned()
        };
        self.nodes.push(Node {
            name,
            value: Value::Array(value),
            inputs: Vec::new(),
            needs_gradient: needs_gradient && self.recording,
            operation: None,
        });
        Var(self.nodes.len() as u32 - 1)
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
        if let Some(var) = self.leaves[id.0].filter(|_| !self.frozen) {
            return var;
        }
        self.nodes.push(Node {
            name: "parameter",
            value: Value::Block(id),
            inputs: Vec::new(),
            needs_gradient: self.recording && !self.frozen,
            operation: None,
        });
        let var = Var(self.nodes.len() as u32 - 1);
        if !self.frozen {
            self.leaves[id.0] = Some(var);
        }
        var
    }

    pub fn shape(&self, var: Var) -> &[usize] {
        self.known().shape(var)
    }

    /// The numbers of a value in row-major order.
    pub fn values(&self, var: Var) -> &[T] {
        self.known().values(var)
    }

    /// A value as an array.
    pub fn array(&self, var: Var) -> ArrayViewD<'_, T> {
        self.known().array(var)
    }

    /// Rows and columns of a value seen as a matrix: the last axis, and all before it.
    pub(super) fn rows_and_columns(&self, var: Var) -> (usize, usize) {
        let shape = self.shape(var);
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

    pub(super) fn give(&mut self, buffer: Vec<T>) {
        self.workspace.give(buffer);
    }

    pub(super) fn known(&self) -> Known<'_, T> {
        Known {
            nodes: &self.nodes,
            parameters: self.parameters,
        }
    }

    /// Puts an operation's output on the tape. `operation` is asked for only where a way back is
    /// wanted.
    pub(super) fn record<O: Operation<T> + 'static>(
        &mut self,
        name: &'static str,
        inputs: &[Var],
        shape: &[usize],
        output: Vec<T>,
        operation: impl FnOnce() -> O,
    ) -> Var {
        let needs_gradient = self.recording && inputs.iter().any(|&v| self.needs_gradient(v));
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
        self.nodes.push(Node {
            name,
            value: Value::Array(array),
            inputs: if self.recording {
                inputs.to_vec()
            } else {
                Vec::new()
            },
            needs_gradient,
            operation,
        });
        Var(self.nodes.len() as u32 - 1)
    }

    /// A place on the tape, see [`Tape::forget_since`].
    pub fn mark(&self) -> usize {
        self.nodes.len()
    }

    /// Without recording: drops every value made since `mark` but those in `keep`, which are
    /// renamed in place. So a long generation needs the memory of one frame.
    pub fn forget_since(&mut self, mark: usize, keep: &mut [&mut Var]) {
        if self.recording {
            return;
        }
        let mut order: Vec<usize> = (0..keep.len())
            .filter(|&k| keep[k].index() >= mark)
            .collect();
        order.sort_by_key(|&k| keep[k].index());
        let mut renamed: Vec<(Var, Var)> = Vec::new();
        let mut end = mark;
        for index in mark..self.nodes.len() {
            let wanted = order.iter().any(|&k| keep[k].index() == index);
            if wanted || matches!(self.nodes[index].value, Value::Block(_)) {
                self.nodes.swap(end, index);
                if let Value::Block(id) = self.nodes[end].value {
                    self.leaves[id.0] = Some(Var(end as u32));
                }
                renamed.push((Var(index as u32), Var(end as u32)));
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

    /// The first value on the tape that is not finite, as an error that names its operation.
    pub fn check_finite(&self) -> Result<(), AutogradError> {
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
            shape: self.shape(Var(index as u32)).to_vec(),
            inputs: node
                .inputs
                .iter()
                .map(|&v| self.shape(v).to_vec())
                .collect(),
        }
    }

    /// Runs the tape backwards from a scalar (a value of one number) and adds the gradients of all
    /// parameters to `gradients`.
    pub fn backward(self, loss: Var, gradients: &mut Gradients<T>) -> Result<(), AutogradError> {
        if self.values(loss).len() != 1 {
            return Err(AutogradError::Argument {
                operation: "backward",
                shape: self.shape(loss).to_vec(),
                argument: "the loss".into(),
                expected: "one number",
            });
        }
        self.backward_from(loss, &[T::one()], &[], gradients)
            .map(|_| ())
    }

    /// Runs the tape backwards from `output` with the upstream gradient `upstream` (in the output's
    /// layout); adds the gradients of the parameters to `gradients` and returns those of `inputs`
    /// (values made by [`Tape::input`]).
    pub fn backward_from(
        mut self,
        output: Var,
        upstream: &[T],
        inputs: &[Var],
        gradients: &mut Gradients<T>,
    ) -> Result<Vec<ArrayD<T>>, AutogradError> {
        let lists = self.workspace.lists();
        let mut slots = std::mem::take(&mut lists.slots);
        slots.resize_with(self.nodes.len(), || None);
        let mut stagings = std::mem::take(&mut lists.stagings);
        stagings.resize_with(self.nodes.len(), || None);
        if self.needs_gradient(output) {
            let mut seed = self.workspace.take(upstream.len());
            seed.copy_from_slice(upstream);
            slots[output.index()] = Some(seed);
        }
        let mut found = Vec::new();
        for index in (0..self.nodes.len()).rev() {
            let operation = self.nodes[index].operation.take();
            let mut context = Backward {
                known: Known {
                    nodes: &self.nodes[..=index],
                    parameters: self.parameters,
                },
                workspace: self.workspace,
                slots: &mut slots,
                stagings: &mut stagings,
                gradients,
                output: Var(index as u32),
                staged: !self.trace,
            };
            context.flush_staging(Var(index as u32));
            if let Some(mut operation) = operation {
                if let Some(mut dy) = context.slots[index].take() {
                    if self.trace
                        && let Some(what) = not_finite(&dy)
                    {
                        return Err(self.non_finite(index, what, "gradient"));
                    }
                    operation.backward(&mut dy, &mut context);
                    if self.trace
                        && let Some(what) = self.nodes[index].inputs.iter().find_map(|input| {
                            let gradient = match self.nodes[input.index()].value {
                                Value::Block(id) => Some(gradients.block(self.parameters, id)),
                                _ => slots[input.index()].as_deref(),
                            };
                            gradient.and_then(not_finite)
                        })
                    {
                        return Err(self.non_finite(index, what, "gradient"));
                    }
                    self.workspace.give(dy);
                }
                operation.release(self.workspace);
            }
            if let Some(k) = inputs.iter().position(|v| v.index() == index) {
                let shape = self.shape(Var(index as u32)).to_vec();
                let gradient = slots[index]
                    .take()
                    .unwrap_or_else(|| vec![T::zero(); shape.iter().product()]);
                let array = ArrayD::from_shape_vec(IxDyn(&shape), gradient)
                    .expect("a gradient has the shape of its value");
                found.push((k, array));
            }
            // Later operations are done and this one too: nothing reads the value any more.
            if index != output.index()
                && let Value::Array(array) =
                    std::mem::replace(&mut self.nodes[index].value, Value::Released)
            {
                self.workspace.give(array.into_raw_vec_and_offset().0);
            }
        }
        for unclaimed in slots.drain(..).flatten() {
            self.workspace.give(unclaimed);
        }
        stagings.clear();
        let lists = self.workspace.lists();
        (lists.slots, lists.stagings) = (slots, stagings);
        found.sort_by_key(|(k, _)| *k);
        Ok(found.into_iter().map(|(_, gradient)| gradient).collect())
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

/// What is on a tape so far, for reading.
pub(super) struct Known<'s, T: Real> {
    nodes: &'s [Node<T>],
    parameters: &'s Parameters<T>,
}

impl<T: Real> Clone for Known<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Real> Copy for Known<'_, T> {}

impl<'s, T: Real> Known<'s, T> {
    fn shape(self, var: Var) -> &'s [usize] {
        match &self.nodes[var.index()].value {
            Value::Array(array) => array.shape(),
            Value::Block(id) => self.parameters.block_shape(*id),
            Value::Released => &[],
        }
    }

    fn values(self, var: Var) -> &'s [T] {
        match &self.nodes[var.index()].value {
            // Every array on the tape is in standard layout.
            Value::Array(array) => array.as_slice().unwrap_or(&[]),
            Value::Block(id) => self.parameters.block_values(*id),
            Value::Released => &[],
        }
    }

    fn array(self, var: Var) -> ArrayViewD<'s, T> {
        ArrayViewD::from_shape(IxDyn(self.shape(var)), self.values(var))
            .expect("a value has as many numbers as its shape says")
    }

    /// A weight `[out, in]` as a matrix.
    fn matrix(self, weight: Var) -> Mat<'s, T> {
        let shape = self.shape(weight);
        Mat::new(self.values(weight), shape[0], shape[1])
    }

    /// out (+)= x W for a weight W `[out, in]`, packed where it is a parameter.
    pub(super) fn product(self, x: Mat<'_, T>, weight: Var, out: MatMut<'_, T>, accumulate: bool) {
        match self.nodes[weight.index()].value {
            Value::Block(id) => product_packed(x, self.parameters.packed(id), out, accumulate),
            _ => product(x, self.matrix(weight), out, accumulate),
        }
    }

    /// out (+)= x W^T for a weight W `[out, in]`, packed where it is a parameter.
    pub(super) fn product_transposed(
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

fn not_finite<T: Real>(values: &[T]) -> Option<&'static str> {
    values
        .iter()
        .find(|x| !x.is_finite())
        .map(|x| if x.is_nan() { "NaN" } else { "infinity" })
}

/// Where an operation's way back writes the gradient of one input.
pub struct Target<'t, T> {
    pub data: &'t mut [T],
    /// Whether the content is undefined, to be written whole, rather than a sum to be added to.
    pub fresh: bool,
}

impl<T: Real> Target<'_, T> {
    /// Adds `values` to the gradient.
    pub fn add_values(self, values: &[T]) {
        if self.fresh {
            self.data.copy_from_slice(values);
            return;
        }
        vectorised(
            #[inline(always)]
            || {
                for (d, &value) in self.data.iter_mut().zip(values) {
                    *d += value;
                }
            },
        );
    }

    /// Adds `gradient(i)` to number i of the gradient, for all i.
    #[inline(always)]
    pub fn add(self, gradient: impl Fn(usize) -> T) {
        let fresh = self.fresh;
        vectorised(
            #[inline(always)]
            || {
                if fresh {
                    for (i, d) in self.data.iter_mut().enumerate() {
                        *d = gradient(i);
                    }
                } else {
                    for (i, d) in self.data.iter_mut().enumerate() {
                        *d += gradient(i);
                    }
                }
            },
        );
    }
}

/// What an operation sees on the way back: the values before it, and the gradients it adds to.
pub struct Backward<'s, T: Real> {
    known: Known<'s, T>,
    workspace: &'s mut Workspace<T>,
    slots: &'s mut [Option<Vec<T>>],
    stagings: &'s mut [Option<Staging<T>>],
    gradients: &'s mut Gradients<T>,
    output: Var,
    /// Whether rows for a weight's gradient are collected; not where each operation's share in it
    /// is looked at.
    staged: bool,
}

impl<'s, T: Real> Backward<'s, T> {
    /// The numbers of an earlier value in row-major order.
    pub fn values(&self, var: Var) -> &'s [T] {
        self.known.values(var)
    }

    pub fn shape(&self, var: Var) -> &'s [usize] {
        self.known.shape(var)
    }

    /// An earlier value as an array.
    pub fn array(&self, var: Var) -> ArrayViewD<'s, T> {
        self.known.array(var)
    }

    /// The operation's own output.
    pub fn output(&self) -> &'s [T] {
        self.values(self.output)
    }

    pub(super) fn known(&self) -> Known<'s, T> {
        self.known
    }

    pub fn needs_gradient(&self, var: Var) -> bool {
        self.known.nodes[var.index()].needs_gradient
    }

    pub fn take(&mut self, len: usize) -> Vec<T> {
        self.workspace.take(len)
    }

    pub fn give(&mut self, buffer: Vec<T>) {
        self.workspace.give(buffer);
    }

    /// Where to add the gradient of an input, if it wants one.
    pub fn target(&mut self, var: Var) -> Option<Target<'_, T>> {
        let node = &self.known.nodes[var.index()];
        if !node.needs_gradient {
            return None;
        }
        match &node.value {
            Value::Block(id) => Some(Target {
                data: self.gradients.block_mut(self.known.parameters, *id),
                fresh: false,
            }),
            Value::Array(array) => {
                let slot = &mut self.slots[var.index()];
                let fresh = slot.is_none();
                let data = slot.get_or_insert_with(|| self.workspace.take(array.len()));
                Some(Target { data, fresh })
            }
            Value::Released => None,
        }
    }

    /// Adds dW = dy^T x to the gradient of a weight W [out, in], for dy [rows, out] and x [rows,
    /// in].
    ///
    /// Few rows (one time step of a recurrent layer) are collected first, so that a weight used at
    /// every time step gets its gradient from few large products instead of many thin ones.
    pub fn weight_gradient(&mut self, weight: Var, dy: Mat<'_, T>, x: Mat<'_, T>) {
        if !self.needs_gradient(weight) || dy.rows == 0 {
            return;
        }
        if dy.rows >= DIRECT_ROWS || !self.staged {
            if let Some(target) = self.target(weight) {
                let fresh = target.fresh;
                product_at(dy, x, MatMut::new(target.data, dy.cols, x.cols), !fresh);
            }
            return;
        }
        let staging =
            self.stagings[weight.index()].get_or_insert_with(|| Staging::new(dy.cols, x.cols));
        staging.push(dy, x, self.workspace);
        if staging.is_full() {
            self.flush_staging(weight);
        }
    }

    fn flush_staging(&mut self, weight: Var) {
        if let Some(staging) = self.stagings[weight.index()].take() {
            if let Some(target) = self.target(weight) {
                staging.product_into(target.data, !target.fresh);
            }
            staging.release(self.workspace);
        }
    }
}

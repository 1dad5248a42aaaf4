//! The way back through a tape.

use std::cell::Cell;

use ndarray::{ArrayD, ArrayViewD, IxDyn};

use super::known::Known;
use super::{Tape, Value, Var, not_finite};
use crate::autograd::error::AutogradError;
use crate::autograd::kernels::{Mat, MatMut, Real, product_at, vectorised};
use crate::autograd::parameters::Gradients;
use crate::autograd::staging::{DIRECT_ROWS, Staging};
use crate::autograd::workspace::Workspace;

impl<T: Real> Tape<'_, T> {
    /// Runs the tape backwards from a scalar (a value of one number) and adds the gradients of all
    /// parameters to `gradients`.
    ///
    /// # Errors
    /// A loss of several numbers; otherwise as [`Tape::backward_from`].
    pub fn backward(self, loss: Var, gradients: &mut Gradients<T>) -> Result<(), AutogradError> {
        self.own("backward", &[loss])?;
        if self.known().values(loss).len() != 1 {
            return Err(AutogradError::Argument {
                operation: "backward",
                shape: self.known().shape(loss).to_vec(),
                argument: "the loss".into(),
                expected: "one number: take the mean or the sum first",
            });
        }
        self.backward_from(loss, &[T::one()], &[], gradients)
            .map(|_| ())
    }

    /// Runs the tape backwards from `output` with the upstream gradient `upstream` (in the output's
    /// layout); adds the gradients of the parameters to `gradients` and returns those of `values`,
    /// in their order: what [`Tape::input`] made and whatever was computed of it or of parameters.
    ///
    /// # Errors
    /// A tape that does not record; an output or a value of another tape; gradients of other
    /// parameters; an upstream gradient of another length than the output; a value that has no
    /// gradient (a constant, or computed of constants) or is a parameter, whose gradient is in
    /// `gradients`; an operation of one's own whose way back asks for values that are not among its
    /// inputs; where the tape traces, a gradient that is not finite.
    pub fn backward_from(
        mut self,
        output: Var,
        upstream: &[T],
        values: &[Var],
        gradients: &mut Gradients<T>,
    ) -> Result<Vec<ArrayD<T>>, AutogradError> {
        self.check_backward(output, upstream, values, gradients)?;
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
                output: index,
                staged: !self.trace,
                misuse: Cell::new(None),
            };
            context.flush_staging(index);
            if values.iter().any(|value| value.index() == index) {
                let shape = context.known.nodes[index].shape(self.parameters);
                // Here it is whole: the operations that read the value are done.
                let gradient = match &context.slots[index] {
                    Some(gradient) => gradient.clone(),
                    None => vec![T::zero(); shape.iter().product()],
                };
                let array = ArrayD::from_shape_vec(IxDyn(shape), gradient)
                    .expect("a gradient has the shape of its value");
                let places = values.iter().enumerate();
                let places = places.filter(|(_, value)| value.index() == index);
                found.extend(places.map(|(place, _)| (place, array.clone())));
            }
            if let Some(mut operation) = operation {
                if let Some(mut dy) = context.slots[index].take() {
                    if self.trace
                        && let Some(what) = not_finite(&dy)
                    {
                        return Err(self.non_finite(index, what, "gradient"));
                    }
                    operation.backward(&mut dy, &mut context);
                    if let Some(what) = context.misuse.take() {
                        let operation = self.nodes[index].name;
                        return Err(AutogradError::Misplaced { operation, what });
                    }
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

    /// Refuses what [`Tape::backward_from`] cannot run backwards.
    fn check_backward(
        &self,
        output: Var,
        upstream: &[T],
        values: &[Var],
        gradients: &Gradients<T>,
    ) -> Result<(), AutogradError> {
        let operation = "backward_from";
        self.own(operation, &[output])?;
        self.own(operation, values)?;
        if !self.recording || !gradients.fit(self.parameters) {
            let what = match self.recording {
                true => {
                    "the gradients are those of other parameters than the tape's: make them by \
                     Gradients::zeros once all parameters are added"
                }
                false => "the tape does not record: make it by Tape::recording",
            };
            return Err(AutogradError::Misplaced { operation, what });
        }
        let unfit = |var, argument, expected| AutogradError::Argument {
            operation,
            shape: self.known().shape(var).to_vec(),
            argument,
            expected,
        };
        if upstream.len() != self.known().values(output).len() {
            let argument = format!("an upstream gradient of {} numbers", upstream.len());
            return Err(unfit(output, argument, "one for each number of the output"));
        }
        for (place, &value) in values.iter().enumerate() {
            let node = &self.nodes[value.index()];
            let expected = match node.value {
                Value::Block(_) => "no parameter: its gradient is in the gradients",
                _ if node.needs_gradient || self.known().values(value).is_empty() => continue,
                _ => "a value of Tape::input, or computed of one or of parameters",
            };
            return Err(unfit(value, format!("value {place}"), expected));
        }
        Ok(())
    }
}

/// Where an operation's way back writes the gradient of one input.
pub struct Target<'t, T> {
    pub data: &'t mut [T],
    /// Whether the content is undefined, to be written whole, rather than a sum to be added to.
    pub fresh: bool,
    misuse: &'t Cell<Option<&'static str>>,
}

impl<'t, T: Real> Target<'t, T> {
    /// The gradient so far, zeros where there is none.
    pub fn so_far(self) -> &'t mut [T] {
        if self.fresh {
            self.data.fill(T::zero());
        }
        self.data
    }

    /// Adds `values` to the gradient; of another length they end the way back with an error.
    pub fn add_values(self, values: &[T]) {
        if values.len() != self.data.len() {
            let what = "its way back adds more or fewer numbers than an input has";
            return self.misuse.set(Some(what));
        }
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
    /// The place of the operation's own output.
    output: usize,
    /// Whether rows for a weight's gradient are collected; not where each operation's share in it
    /// is looked at.
    staged: bool,
    /// What an operation did that it must not; the way back ends with it.
    misuse: Cell<Option<&'static str>>,
}

/// Asked for a value that was not on the tape before the operation, all say that there are no
/// numbers, and the way back ends with an error.
impl<'s, T: Real> Backward<'s, T> {
    /// The numbers of an earlier value in row-major order.
    pub fn values(&self, var: Var) -> &'s [T] {
        match self.knows(var) {
            true => self.known.values(var),
            false => &[],
        }
    }

    pub fn shape(&self, var: Var) -> &'s [usize] {
        match self.knows(var) {
            true => self.known.shape(var),
            false => &[0],
        }
    }

    /// An earlier value as an array.
    pub fn array(&self, var: Var) -> ArrayViewD<'s, T> {
        ArrayViewD::from_shape(IxDyn(self.shape(var)), self.values(var))
            .expect("a value has as many numbers as its shape says")
    }

    fn knows(&self, var: Var) -> bool {
        let earlier = self.known.nodes.get(var.index());
        let knows = earlier.is_some_and(|node| node.stamp == var.stamp);
        if !knows {
            let what = "its way back asks for a value that is not among its inputs";
            self.misuse.set(Some(what));
        }
        knows
    }

    /// The operation's own output.
    pub fn output(&self) -> &'s [T] {
        self.known.values_at(self.output)
    }

    pub(in crate::autograd) fn known(&self) -> Known<'s, T> {
        self.known
    }

    pub fn needs_gradient(&self, var: Var) -> bool {
        self.knows(var) && self.known.nodes[var.index()].needs_gradient
    }

    pub fn take(&mut self, len: usize) -> Vec<T> {
        self.workspace.take(len)
    }

    pub fn give(&mut self, buffer: Vec<T>) {
        self.workspace.give(buffer);
    }

    /// Where to add the gradient of an input, if it wants one.
    pub fn target(&mut self, var: Var) -> Option<Target<'_, T>> {
        match self.knows(var) {
            true => self.target_at(var.index()),
            false => None,
        }
    }

    fn target_at(&mut self, index: usize) -> Option<Target<'_, T>> {
        let node = &self.known.nodes[index];
        if !node.needs_gradient {
            return None;
        }
        match &node.value {
            Value::Block(id) => Some(Target {
                data: self.gradients.block_mut(self.known.parameters, *id),
                fresh: false,
                misuse: &self.misuse,
            }),
            Value::Array(array) => {
                let slot = &mut self.slots[index];
                let fresh = slot.is_none();
                let data = slot.get_or_insert_with(|| self.workspace.take(array.len()));
                let misuse = &self.misuse;
                Some(Target {
                    data,
                    fresh,
                    misuse,
                })
            }
            Value::Released => None,
        }
    }

    /// Adds dW = dy^T x to the gradient of a weight W [out, in], for dy [rows, out] and
    /// x [rows, in].
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
            self.flush_staging(weight.index());
        }
    }

    fn flush_staging(&mut self, weight: usize) {
        if let Some(staging) = self.stagings[weight].take() {
            if let Some(target) = self.target_at(weight) {
                staging.product_into(target.data, !target.fresh);
            }
            staging.release(self.workspace);
        }
    }
}

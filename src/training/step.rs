//! One step: its shards run forwards and backwards, Adam moves the weights.

use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::error::TrainingError;
use crate::autograd::{AutogradError, BufferId, Gradients, Parameters, Tape, Workspace};
use crate::counted::counted;
use crate::models::{Step, Streams};
use crate::optim::{Adam, AdamError};

/// What a step is given.
#[derive(Clone, Copy)]
pub struct StepInput<'s> {
    pub step: &'s dyn Step<f32>,
    pub streams: Streams,
    /// Steps done before.
    pub done: u64,
}

/// Losses of a step or of a shard of it.
#[derive(Debug, Default)]
pub struct Losses {
    pub total: f64,
    /// By name, not weighted.
    pub terms: Vec<(&'static str, f64)>,
    /// New values of buffers.
    buffers: Vec<(BufferId, Vec<f64>)>,
}

/// Threads for rayon.
///
/// # Errors
/// The system gives no more threads.
pub fn pool(threads: usize) -> Result<ThreadPool, TrainingError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|cause| {
        TrainingError::Refused(format!(
            "no pool of {}: {cause}",
            counted(threads, "thread")
        ))
    })
}

/// Threads and buffers that one step leaves for the next.
pub struct Stepper {
    pool: ThreadPool,
    workspaces: Mutex<Vec<Workspace<f32>>>,
    /// One for each shard that a step has had, zero between steps.
    gradients: Vec<Gradients<f32>>,
}

impl Stepper {
    /// # Errors
    /// No threads to be had.
    pub fn new(threads: usize) -> Result<Self, TrainingError> {
        Ok(Self {
            pool: pool(threads)?,
            workspaces: Mutex::new(Vec::new()),
            gradients: Vec::new(),
        })
    }

    /// Runs something else on the threads of the steps.
    pub fn install<R: Send>(&self, run: impl FnOnce() -> R + Send) -> R {
        self.pool.install(run)
    }

    /// Computes the step and moves the weights. Returns the losses before the move, and the norm of
    /// the gradient.
    ///
    /// # Errors
    /// The step is refused by an operation; or a loss or gradient is not finite, and then weights
    /// and moments are as before; or the weights are not after it.
    pub fn step(
        &mut self,
        input: StepInput<'_>,
        parameters: &mut Parameters<f32>,
        adam: &mut Adam<f32>,
    ) -> Result<(Losses, f64), TrainingError> {
        let result = self.try_step(input, parameters, adam);
        if result.is_err() {
            self.gradients.iter_mut().for_each(Gradients::set_zero);
        }
        result
    }

    fn try_step(
        &mut self,
        input: StepInput<'_>,
        parameters: &mut Parameters<f32>,
        adam: &mut Adam<f32>,
    ) -> Result<(Losses, f64), TrainingError> {
        let shards = input.step.shards();
        while self.gradients.len() < shards {
            self.gradients.push(Gradients::zeros(parameters));
        }
        let gradients = &mut self.gradients[..shards];
        let (workspaces, before, pool) = (&self.workspaces, &*parameters, &self.pool);
        let free = || workspaces.lock().unwrap_or_else(PoisonError::into_inner);
        let losses: Vec<Result<Losses, AutogradError>> = pool.install(|| {
            gradients
                .par_iter_mut()
                .enumerate()
                .map(|(shard, gradients)| {
                    let taken = free().pop();
                    let mut workspace = taken.unwrap_or_default();
                    let losses = run_shard(input, before, &mut workspace, shard, gradients, false);
                    free().push(workspace);
                    losses
                })
                .collect()
        });
        let mut sum = Losses::default();
        for losses in losses {
            let losses = losses.map_err(|cause| failure(input, cause))?;
            sum.total += losses.total;
            for ((_, sum), (_, term)) in sum.terms.iter_mut().zip(&losses.terms) {
                *sum += term;
            }
            if sum.terms.is_empty() {
                sum.terms = losses.terms;
            }
            sum.buffers.extend(losses.buffers);
        }
        let norm = pool.install(|| adam.step_shards(parameters, gradients));
        match norm {
            Ok(norm) => {
                take_up_buffers(parameters, &sum.buffers).map_err(|cause| failure(input, cause))?;
                match first_not_finite(parameters) {
                    None => Ok((sum, norm)),
                    Some((name, shape)) => Err(non_finite(
                        input,
                        format!("it left {name} {shape:?} with a NaN or an infinity"),
                    )),
                }
            }
            Err(error @ (AdamError::Setting(_) | AdamError::OtherParameters)) => {
                Err(refused(input, &error))
            }
            Err(error) => {
                let cause = trace(input, parameters, gradients).map(|cause| cause.to_string());
                Err(non_finite(input, cause.unwrap_or(error.to_string())))
            }
        }
    }
}

/// Runs the shards once more, slowly, to find the first operation whose gradient is not finite.
fn trace(
    input: StepInput<'_>,
    parameters: &Parameters<f32>,
    gradients: &mut [Gradients<f32>],
) -> Option<AutogradError> {
    let mut workspace = Workspace::new();
    // One sum for all shards: each may be finite where their sum is not.
    let sum = gradients.first_mut()?;
    sum.set_zero();
    (0..input.step.shards())
        .map(|shard| run_shard(input, parameters, &mut workspace, shard, sum, true))
        .find_map(Result::err)
}

/// Each buffer becomes the mean of the values that shards give for it, in the order of the shards.
fn take_up_buffers(
    parameters: &mut Parameters<f32>,
    given: &[(BufferId, Vec<f64>)],
) -> Result<(), AutogradError> {
    let mut done: Vec<BufferId> = Vec::new();
    for (id, _) in given {
        if done.contains(id) {
            continue;
        }
        done.push(*id);
        let of_buffer = || given.iter().filter(|(of, _)| of == id);
        let count = of_buffer().count() as f64;
        for (index, value) in parameters.buffer_mut(*id)?.iter_mut().enumerate() {
            let values = of_buffer().filter_map(|(_, values)| values.get(index));
            *value = (values.sum::<f64>() / count) as f32;
        }
    }
    Ok(())
}

/// The first parameter or buffer with a NaN or an infinity, and its shape.
fn first_not_finite(parameters: &Parameters<f32>) -> Option<(&str, &[usize])> {
    // To the end in any case, so that it vectorises.
    let finite = |values: &[f32]| values.iter().fold(true, |all, x| all & x.is_finite());
    parameters
        .saved()
        .find(|(_, value)| !value.as_slice().is_some_and(finite))
        .map(|(name, value)| (name, value.shape()))
}

/// Losses of a shard; its gradients are added to `gradients`.
fn run_shard(
    input: StepInput<'_>,
    parameters: &Parameters<f32>,
    workspace: &mut Workspace<f32>,
    shard: usize,
    gradients: &mut Gradients<f32>,
    trace: bool,
) -> Result<Losses, AutogradError> {
    let mut tape = Tape::recording(parameters, workspace)
        .with_dropout(input.streams.dropout(input.done, shard));
    if trace {
        tape = tape.with_trace();
    }
    let losses = input.step.losses(&mut tape, shard)?;
    let number = |var| tape.values(var).iter().map(|&x| f64::from(x)).sum::<f64>();
    let terms = losses.terms.iter();
    let values = Losses {
        total: number(losses.total),
        terms: terms.map(|&(name, var)| (name, number(var))).collect(),
        buffers: losses.buffers,
    };
    if !values.total.is_finite() || values.terms.iter().any(|(_, x)| !x.is_finite()) {
        tape.check_finite()?;
    }
    tape.backward(losses.total, gradients)?;
    Ok(values)
}

fn failure(input: StepInput<'_>, cause: AutogradError) -> TrainingError {
    match cause {
        AutogradError::NonFinite { .. } => non_finite(input, cause.to_string()),
        cause => refused(input, &cause),
    }
}

fn refused(input: StepInput<'_>, cause: &dyn std::error::Error) -> TrainingError {
    let (step, what) = (input.done + 1, input.step.describe());
    TrainingError::Refused(format!("step {step} ({what}): {cause}"))
}

fn non_finite(input: StepInput<'_>, cause: String) -> TrainingError {
    TrainingError::NonFinite {
        step: input.done + 1,
        what: input.step.describe(),
        cause,
    }
}

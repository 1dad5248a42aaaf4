//! One step: its shards run forwards and backwards, Adam moves the weights.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::error::StepError;
use super::losses::Losses;
use super::meeting::{Place, run_meeting};
use crate::autograd::{AutogradError, BufferId, Gradients, Parameters, Tape, Workspace};
use crate::counted::counted;
use crate::models::{Meeting, Step, Streams};
use crate::optim::{Adam, AdamError};
use crate::ranks::Together;

/// What a step is given.
#[derive(Clone, Copy)]
pub struct StepInput<'s> {
    pub step: &'s dyn Step<f32>,
    pub streams: Streams,
    /// Steps done before.
    pub done: u64,
}

impl<'t> StepInput<'_> {
    /// A tape for one of the step's parts.
    pub(super) fn tape(
        &self,
        parameters: &'t Parameters<f32>,
        workspace: &'t mut Workspace<f32>,
        part: usize,
        trace: bool,
    ) -> Tape<'t, f32> {
        let key = self.streams.dropout(self.done, part);
        let tape = Tape::recording(parameters, workspace).with_dropout(key);
        match trace {
            true => tape.with_trace(),
            false => tape,
        }
    }
}

/// Threads for rayon.
///
/// # Errors
/// The system gives no more threads.
pub fn pool(threads: usize) -> Result<ThreadPool, StepError> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map_err(|cause| {
        StepError::Refused(format!(
            "no pool of {}: {cause}",
            counted(threads, "thread")
        ))
    })
}

/// Threads and buffers that one step leaves for the next.
pub struct Stepper {
    pool: ThreadPool,
    /// One for each thread: its memory is where the thread is that first wrote it, on machines with
    /// several places for it.
    workspaces: Vec<Mutex<Workspace<f32>>>,
    /// Of shards that meet, and one for what they have in common.
    of_meeting: Vec<Workspace<f32>>,
    /// One for each shard that a step has had on this rank, zero between steps.
    gradients: Vec<Gradients<f32>>,
    pub together: Together,
    /// Time that the sum of the shards' gradients and Adam took in the last step.
    pub updating: Duration,
}

impl Stepper {
    /// # Errors
    /// No threads to be had.
    pub fn new(threads: usize) -> Result<Self, StepError> {
        Ok(Self {
            pool: pool(threads)?,
            workspaces: (0..threads).map(|_| Mutex::default()).collect(),
            of_meeting: Vec::new(),
            gradients: Vec::new(),
            together: Together::default(),
            updating: Duration::ZERO,
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
    ) -> Result<(Losses, f64), StepError> {
        let result = self.try_step(input, parameters, adam);
        if result.is_err() {
            self.gradients.iter_mut().for_each(Gradients::set_zero);
        }
        result
    }

    /// Seconds that the step takes, tried on copies of weights and optimiser; none where it fails.
    pub fn trial(
        &mut self,
        input: StepInput<'_>,
        parameters: &Parameters<f32>,
        adam: &Adam<f32>,
    ) -> Option<f64> {
        let (mut parameters, mut adam) = (parameters.clone(), adam.clone());
        let mut seconds = || {
            let start = Instant::now();
            let result = self.step(input, &mut parameters, &mut adam);
            let taken = result.ok().map(|_| start.elapsed().as_secs_f64())?;
            // Where it is short, a second is worth its time: where it is on any rank, on all.
            let short = self.together.any(taken < 1.0).ok()?;
            Some((taken, short))
        };
        // The first fills the buffers.
        match seconds()? {
            (_, true) => seconds().map(|(taken, _)| taken),
            (taken, false) => Some(taken),
        }
    }

    /// Losses of this rank's shards; their gradients are added to `self.gradients`.
    fn own_losses(
        &mut self,
        input: StepInput<'_>,
        parameters: &Parameters<f32>,
        own: Range<usize>,
    ) -> Result<Vec<Losses>, StepError> {
        let gradients = &mut self.gradients[..own.len()];
        let (workspaces, pool) = (&self.workspaces, &self.pool);
        if let Some(meeting) = meeting_of(input.step) {
            let count = self.of_meeting.len().max(own.len() + 1);
            self.of_meeting.resize_with(count, Workspace::new);
            let place = Place {
                workspaces: &mut self.of_meeting[..=own.len()],
                gradients,
                together: &mut self.together,
                shards: own,
            };
            return pool.install(|| run_meeting(input, meeting, parameters, place, false));
        }
        let losses: Vec<Result<Losses, AutogradError>> = pool.install(|| {
            gradients
                .par_iter_mut()
                .zip(own)
                .map(|(gradients, shard)| {
                    let thread = rayon::current_thread_index().unwrap_or(0);
                    let workspace = workspaces[thread].lock();
                    let mut workspace = workspace.unwrap_or_else(PoisonError::into_inner);
                    run_shard(input, parameters, &mut workspace, shard, gradients, false)
                })
                .collect()
        });
        let losses = losses.into_iter();
        losses
            .map(|losses| losses.map_err(|cause| failure(input, cause)))
            .collect()
    }

    fn try_step(
        &mut self,
        input: StepInput<'_>,
        parameters: &mut Parameters<f32>,
        adam: &mut Adam<f32>,
    ) -> Result<(Losses, f64), StepError> {
        let shards = input.step.shards();
        let own = self.together.own_shards(shards);
        // A rank without a shard takes part in the sum.
        let count = own.len().max(1);
        while self.gradients.len() < count {
            self.gradients.push(Gradients::zeros(parameters));
        }
        let losses = self.own_losses(input, parameters, own);
        let sum = Losses::of_all(losses, parameters, &mut self.together)?;
        let begun = Instant::now();
        let (pool, mut gradients) = (&self.pool, &mut self.gradients[..count]);
        if !self.together.is_alone() {
            self.together.sum(shards, gradients);
            gradients = &mut gradients[..1];
        }
        let norm = pool.install(|| adam.step_shards(parameters, gradients));
        self.updating = begun.elapsed();
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
                let cause = trace(input, parameters, gradients);
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
) -> Option<String> {
    let mut workspace = Workspace::new();
    let shards = input.step.shards();
    if let Some(meeting) = meeting_of(input.step) {
        let mut gradients = vec![Gradients::zeros(parameters); shards];
        let mut workspaces = Vec::new();
        workspaces.resize_with(shards + 1, Workspace::new);
        let place = Place {
            workspaces: &mut workspaces,
            gradients: &mut gradients,
            together: &mut Together::default(),
            shards: 0..shards,
        };
        let ended = run_meeting(input, meeting, parameters, place, true).err();
        return ended.map(|error| match error {
            StepError::NonFinite { cause, .. } => cause,
            error => error.to_string(),
        });
    }
    // One sum for all shards: each may be finite where their sum is not.
    let sum = gradients.first_mut()?;
    sum.set_zero();
    (0..shards)
        .map(|shard| run_shard(input, parameters, &mut workspace, shard, sum, true))
        .find_map(|losses| losses.err().map(|cause| cause.to_string()))
}

/// Where the step's shards meet, if it has several that do.
fn meeting_of(step: &dyn Step<f32>) -> Option<&dyn Meeting<f32>> {
    step.meeting().filter(|_| step.shards() > 1)
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
    let mut tape = input.tape(parameters, workspace, shard, trace);
    let losses = input.step.losses(&mut tape, shard)?;
    let values = Losses::read(&tape, &losses);
    if !values.are_finite() {
        tape.check_finite()?;
    }
    tape.backward(losses.total, gradients)?;
    Ok(values)
}

pub(super) fn failure(input: StepInput<'_>, cause: AutogradError) -> StepError {
    match cause {
        AutogradError::NonFinite { .. } => non_finite(input, cause.to_string()),
        cause => refused(input, &cause),
    }
}

fn refused(input: StepInput<'_>, cause: &dyn std::error::Error) -> StepError {
    let (step, what) = (input.done + 1, input.step.describe());
    StepError::Refused(format!("step {step} ({what}): {cause}"))
}

fn non_finite(input: StepInput<'_>, cause: String) -> StepError {
    StepError::NonFinite {
        step: input.done + 1,
        what: input.step.describe(),
        cause,
    }
}

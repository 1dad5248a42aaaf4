//! How fast a training step is: the very step that a training runs, on made-up windows.

use std::fmt;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::error::StepError;
use super::stepper::{StepInput, Stepper};
use crate::autograd::Parameters;
use crate::counted::counted;
use crate::experiment::ExperimentConfig;
use crate::models::{Streams, Task};
use crate::nn::Initialiser;
use crate::nn::measure::fastest;
use crate::optim::Adam;
use crate::ranks::{Ranks, Together, Traffic};

/// A training step that can be timed again and again: forward, losses, backward and Adam.
pub struct MeasuredStep {
    streams: Streams,
    task: Box<dyn Task<f32>>,
    parameters: Parameters<f32>,
    adam: Adam<f32>,
    stepper: Stepper,
    done: u64,
}

impl MeasuredStep {
    /// Steps of the config's model on `batch` windows of `frames` frames, or of as many as the
    /// model has itself.
    ///
    /// # Errors
    /// A config that has nothing to train or settings out of their range, no threads to be had.
    pub fn new(
        config: &ExperimentConfig,
        frames: Option<usize>,
        batch: usize,
        threads: usize,
    ) -> Result<Self, StepError> {
        let streams = Streams::new(config.seed);
        let mut parameters = Parameters::new();
        let mut init = Initialiser::new(&mut parameters, streams.initialisation());
        let task = config
            .model
            .made_up_task(frames, batch, streams, &mut init)?;
        Ok(Self {
            streams,
            adam: Adam::new(config.optimiser.clone(), &parameters)?
                .with_rate_groups(&parameters, |name| task.rate_group(name)),
            task,
            stepper: Stepper::new(threads)?,
            parameters,
            done: 0,
        })
    }

    /// The same with the work shared among ranks.
    #[must_use]
    pub fn on(mut self, ranks: Arc<dyn Ranks>) -> Self {
        self.stepper.together = Together::new(ranks);
        self
    }

    /// What was sent to other ranks so far, and how long they were waited for.
    pub fn traffic(&self) -> Traffic {
        self.stepper.together.traffic()
    }

    /// Frames that a step trains.
    pub fn frames(&self) -> usize {
        self.task.step(0).frames() as usize
    }

    /// Parts that a step is computed in.
    pub fn shards(&self) -> usize {
        self.task.step(0).shards()
    }

    /// Does one step and says how long it took.
    ///
    /// # Errors
    /// A loss or gradient that is not finite.
    pub fn run(&mut self) -> Result<Duration, StepError> {
        let step = self.task.step(self.done);
        let input = StepInput {
            step: &*step,
            streams: self.streams,
            done: self.done,
        };
        let start = Instant::now();
        self.stepper
            .step(input, &mut self.parameters, &mut self.adam)?;
        let taken = start.elapsed();
        self.done += 1;
        Ok(taken)
    }
}

/// Speed of a training step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepSpeed {
    /// Frames of a window.
    pub frames: usize,
    /// Windows in the batch.
    pub batch: usize,
    pub shards: usize,
    pub threads: usize,
    /// Processes that share the shards, each with as many threads.
    pub ranks: usize,
    /// What this one sent in a step, bytes, and how long it waited for others, s; means.
    pub bytes_sent: f64,
    pub seconds_waiting: f64,
    /// Of a step: the sum of the shards' gradients and Adam, s; the least.
    pub seconds_updating: f64,
    /// The fastest of the timed steps, s.
    pub seconds: f64,
    /// Frames predicted in forward, backward and update a second, at that.
    pub frame_steps_per_second: f64,
}

impl fmt::Display for StepSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "training step, {} of {}, {}",
            counted(self.batch, "window"),
            counted(self.frames, "frame"),
            counted(self.threads, "thread")
        )?;
        if self.ranks > 1 {
            write!(f, " on each of {} ranks", self.ranks)?;
        }
        let (seconds, rate) = (self.seconds, self.frame_steps_per_second);
        let updating = self.seconds_updating;
        write!(
            f,
            ": {seconds:.3} s ({updating:.3} of it sum and Adam), {rate:.0} frame-steps/s"
        )?;
        if self.ranks > 1 {
            let (sent, waiting) = (self.bytes_sent / 1e6, self.seconds_waiting);
            write!(f, "; rank 0 sends {sent:.1} MB and waits {waiting:.3} s")?;
        }
        Ok(())
    }
}

/// Times `repetitions` steps after one to warm up, on these ranks.
///
/// # Errors
/// As [`MeasuredStep::new`] and [`MeasuredStep::run`].
pub fn step_speed(
    config: &ExperimentConfig,
    frames: Option<usize>,
    batch: usize,
    threads: usize,
    repetitions: usize,
    ranks: Arc<dyn Ranks>,
) -> Result<StepSpeed, StepError> {
    let count = ranks.count();
    let mut step = MeasuredStep::new(config, frames, batch, threads)?.on(ranks);
    let mut updating = Duration::MAX;
    let seconds = fastest(repetitions, || {
        let taken = step.run()?;
        updating = updating.min(step.stepper.updating);
        Ok::<_, StepError>(taken)
    })?;
    let (traffic, steps) = (step.traffic(), step.done as f64);
    let frames = step.frames();
    Ok(StepSpeed {
        frames: frames / batch.max(1),
        batch,
        shards: step.shards(),
        threads,
        ranks: count,
        bytes_sent: traffic.bytes_sent as f64 / steps,
        seconds_waiting: traffic.seconds / steps,
        seconds_updating: updating.as_secs_f64(),
        seconds,
        frame_steps_per_second: frames as f64 / seconds,
    })
}

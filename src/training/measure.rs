//! How fast a training step is: the very step that a training runs, on made-up windows.

use std::fmt;
use std::time::{Duration, Instant};

use serde::Serialize;

use super::error::TrainingError;
use super::step::{StepInput, Stepper};
use crate::autograd::Parameters;
use crate::counted::counted;
use crate::experiment::ExperimentConfig;
use crate::models::{Streams, Task};
use crate::nn::Initialiser;
use crate::nn::measure::fastest;
use crate::optim::Adam;

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
    /// Steps of the config's model on `batch` windows of `frames` frames.
    ///
    /// # Errors
    /// A config that has nothing to train or settings out of their range, no threads to be had.
    pub fn new(
        config: &ExperimentConfig,
        frames: usize,
        batch: usize,
        threads: usize,
    ) -> Result<Self, TrainingError> {
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

    /// Parts that a step is computed in.
    pub fn shards(&self) -> usize {
        self.task.step(0).shards()
    }

    /// Does one step and says how long it took.
    ///
    /// # Errors
    /// A loss or gradient that is not finite.
    pub fn run(&mut self) -> Result<Duration, TrainingError> {
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
    /// The fastest of the timed steps, s.
    pub seconds: f64,
    /// Frames predicted in forward, backward and update a second, at that.
    pub frame_steps_per_second: f64,
}

impl fmt::Display for StepSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "training step, {} of {}, {}: {:.3} s, {:.0} frame-steps/s",
            counted(self.batch, "window"),
            counted(self.frames, "frame"),
            counted(self.threads, "thread"),
            self.seconds,
            self.frame_steps_per_second
        )
    }
}

/// Times `repetitions` steps after one to warm up.
///
/// # Errors
/// As [`MeasuredStep::new`] and [`MeasuredStep::run`].
pub fn step_speed(
    config: &ExperimentConfig,
    frames: usize,
    batch: usize,
    threads: usize,
    repetitions: usize,
) -> Result<StepSpeed, TrainingError> {
    let mut step = MeasuredStep::new(config, frames, batch, threads)?;
    let seconds = fastest(repetitions, || step.run())?;
    Ok(StepSpeed {
        frames,
        batch,
        shards: step.shards(),
        threads,
        seconds,
        frame_steps_per_second: (frames * batch) as f64 / seconds,
    })
}

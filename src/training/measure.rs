//! How fast a training step is: the very step that a training runs, on made-up windows.

use std::time::Instant;

use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use serde::Serialize;

use super::config::ExperimentConfig;
use super::error::TrainingError;
use super::schedule::BatchPlan;
use super::step::{StepInput, Stepper, TrainingWindows};
use super::streams::Streams;
use crate::autograd::Parameters;
use crate::data::{Standardisation, Window};
use crate::models::Feed;
use crate::motion::features::FEATURES;
use crate::nn::Initialiser;
use crate::optim::Adam;

/// Time of a training step: forward, losses, backward and Adam, own predictions fed back, dropout on.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct StepSpeed {
    /// N, frames of a transition.
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

/// Times `repetitions` steps after one to warm up.
///
/// # Errors
/// A config that has nothing to train.
pub fn step_speed(
    config: &ExperimentConfig,
    frames: usize,
    batch: usize,
    threads: usize,
    repetitions: usize,
) -> Result<StepSpeed, TrainingError> {
    let streams = Streams::new(config.seed);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(config.seed);
    let clip = Array2::from_shape_simple_fn((frames + batch, FEATURES), || {
        rng.random_range(-1.0..1.0)
    });
    let standardisation = Standardisation::fit([clip.view()]);
    let mut parameters = Parameters::new();
    let mut init = Initialiser::new(&mut parameters, streams.initialisation());
    let network = config.model.build(&mut init, &standardisation)?;
    let windows = TrainingWindows {
        clips: vec![&clip],
        standardisation,
    };
    let mut adam = Adam::new(config.optimiser, &parameters);
    let shards = config.schedule.shards;
    let mut stepper = Stepper::new(&parameters, shards, threads)?;
    let plan = BatchPlan {
        length: frames,
        windows: (0..batch).map(|start| Window { clip: 0, start }).collect(),
    };
    let mut seconds = f64::INFINITY;
    for step in 0..=repetitions as u64 {
        let input = StepInput {
            network: &*network,
            windows: &windows,
            streams,
            step,
            plan: &plan,
            feed: Feed::Predictions,
        };
        let start = Instant::now();
        stepper.step(&input, &mut parameters, &mut adam)?;
        if step > 0 {
            seconds = seconds.min(start.elapsed().as_secs_f64());
        }
    }
    Ok(StepSpeed {
        frames,
        batch,
        shards,
        threads,
        seconds,
        frame_steps_per_second: (frames * batch) as f64 / seconds,
    })
}

//! How fast a training step is: the very step that a training runs, on made-up windows.

use std::borrow::Cow;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use ndarray::Array2;
use rand::{RngExt, SeedableRng};
use serde::Serialize;

use super::error::TrainingError;
use super::step::{StepInput, StepPlan, Stepper, TrainingClip, TrainingWindows};
use crate::autograd::Parameters;
use crate::experiment::config::ExperimentConfig;
use crate::models::streams::Streams;
use crate::models::transition::single_frames;
use crate::models::transition::{Feed, Network};
use crate::models::transition::{RootFrame, Standardisation, Window};
use crate::motion::features::FEATURES;
use crate::motion::{JOINTS, Pose};
use crate::nn::Initialiser;
use crate::optim::Adam;

/// A training step that can be timed again and again: forward, losses, backward and Adam, own predictions fed back, dropout on.
pub struct MeasuredStep {
    streams: Streams,
    network: Box<dyn Network<f32>>,
    parameters: Parameters<f32>,
    standardisation: Standardisation,
    clip: Array2<f64>,
    poses: Vec<Pose>,
    adam: Adam<f32>,
    stepper: Stepper,
    plan: StepPlan,
    learning_rate: f64,
    done: u64,
}

impl MeasuredStep {
    /// Steps of the config's model on `batch` windows of `frames` + 1 frames.
    ///
    /// # Errors
    /// A config that has nothing to train, no threads to be had.
    pub fn new(
        config: &ExperimentConfig,
        frames: usize,
        batch: usize,
        threads: usize,
    ) -> Result<Self, TrainingError> {
        let streams = Streams::new(config.seed);
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(config.seed);
        let clip = Array2::from_shape_simple_fn((frames + batch, FEATURES), || {
            rng.random_range(-1.0..1.0)
        });
        let poses = std::iter::repeat_with(|| Pose {
            translations: vec![DVec3::Y; JOINTS],
            rotations: (0..JOINTS)
                .map(|_| DQuat::from_rotation_x(rng.random_range(-1.0..1.0)))
                .collect(),
        });
        let poses = poses.take(clip.nrows()).collect();
        let standardisation = Standardisation::fit([clip.view()]);
        let mut parameters = Parameters::new();
        let mut init = Initialiser::new(&mut parameters, streams.initialisation());
        let network = config.model.build(&mut init, &standardisation)?;
        let count = network.single_frames();
        let single_frames =
            single_frames::draw(&[clip.nrows()], count, &mut streams.single_frames(0));
        Ok(Self {
            streams,
            adam: Adam::new(config.optimiser, &parameters, |name| {
                network.in_transformer(name)
            }),
            network,
            stepper: Stepper::new(&parameters, config.schedule.shards, threads)?,
            parameters,
            standardisation,
            clip,
            poses,
            plan: StepPlan {
                single_frames,
                length: frames,
                windows: (0..batch).map(|start| Window { clip: 0, start }).collect(),
            },
            learning_rate: config.optimiser.learning_rate,
            done: 0,
        })
    }

    /// Does one step and says how long it took.
    ///
    /// # Errors
    /// A loss or gradient that is not finite.
    pub fn run(&mut self) -> Result<Duration, TrainingError> {
        let windows = TrainingWindows {
            clips: vec![TrainingClip {
                features: Cow::Borrowed(&self.clip),
                poses: Cow::Borrowed(&self.poses),
            }],
            standardisation: self.standardisation.clone(),
            root_frame: RootFrame::World,
        };
        let input = StepInput {
            network: &*self.network,
            windows: &windows,
            streams: self.streams,
            step: self.done,
            plan: &self.plan,
            feed: Feed::Predictions,
            learning_rate: self.learning_rate,
        };
        let start = Instant::now();
        self.stepper
            .step(&input, &mut self.parameters, &mut self.adam)?;
        self.done += 1;
        Ok(start.elapsed())
    }
}

/// Speed of a training step.
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
/// As [`MeasuredStep::new`] and [`MeasuredStep::run`].
pub fn step_speed(
    config: &ExperimentConfig,
    frames: usize,
    batch: usize,
    threads: usize,
    repetitions: usize,
) -> Result<StepSpeed, TrainingError> {
    let mut step = MeasuredStep::new(config, frames, batch, threads)?;
    step.run()?;
    let mut seconds = f64::INFINITY;
    for _ in 0..repetitions {
        seconds = seconds.min(step.run()?.as_secs_f64());
    }
    Ok(StepSpeed {
        frames,
        batch,
        shards: config.schedule.shards,
        threads,
        seconds,
        frame_steps_per_second: (frames * batch) as f64 / seconds,
    })
}

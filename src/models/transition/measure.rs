//! How fast a model generates: transitions from made-up keyframes, without a tape that records.

use std::fmt;
use std::time::{Duration, Instant};

use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use serde::Serialize;

use super::ModelConfig;
use super::Standardisation;
use super::{Batch, Network, PoseWindows};
use crate::autograd::{Parameters, Tape, Workspace};
use crate::counted::counted;
use crate::models::ModelError;
use crate::motion::features::FEATURES;
use crate::nn::Initialiser;
use crate::nn::measure::fastest;

/// Frames of the transitions whose speed is told.
const FRAMES: usize = 60;

/// Speed of the generation of transitions of 60 frames by the paper's whole model.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct GenerationSpeed {
    /// Transitions at once.
    pub batch: usize,
    pub threads: usize,
    /// Of a frame of all of them, the fastest of the timed generations.
    pub ms_per_frame: f64,
    pub frames_per_second: f64,
}

impl GenerationSpeed {
    /// Times `repetitions` generations after one to warm up.
    ///
    /// # Errors
    /// As [`MeasuredGeneration::new`].
    pub fn measure(batch: usize, threads: usize, repetitions: usize) -> Result<Self, ModelError> {
        let config = ModelConfig::default();
        let mut generation = MeasuredGeneration::new(&config, FRAMES, batch, threads)?;
        let seconds = fastest(repetitions, || generation.run())?;
        Ok(Self {
            batch,
            threads,
            ms_per_frame: seconds * 1e3 / FRAMES as f64,
            frames_per_second: (FRAMES * batch) as f64 / seconds,
        })
    }
}

impl fmt::Display for GenerationSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "generation, {} at once, {}: {:.2} ms a frame, {:.0} frames/s",
            self.batch,
            counted(self.threads, "thread"),
            self.ms_per_frame,
            self.frames_per_second
        )
    }
}

/// A generation that can be timed again and again.
pub struct MeasuredGeneration {
    network: Box<dyn Network<f32>>,
    parameters: Parameters<f32>,
    pool: rayon::ThreadPool,
    parts: Vec<(Batch<f32>, Workspace<f32>)>,
}

impl MeasuredGeneration {
    /// `batch` transitions of `frames` frames at once, shared by `threads` threads.
    ///
    /// # Errors
    /// A model that is not trained, no threads to be had.
    pub fn new(
        config: &ModelConfig,
        frames: usize,
        batch: usize,
        threads: usize,
    ) -> Result<Self, ModelError> {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let standardisation = Standardisation {
            mean: vec![0.0; FEATURES],
            std: vec![1.0; FEATURES],
            position_scale: 1.0,
            velocity_scale: 1.0,
        };
        let mut parameters = Parameters::new();
        let mut init = Initialiser::new(&mut parameters, rng.clone());
        let network = config.build(&mut init, &standardisation)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|cause| ModelError::Model {
                model: "generation".into(),
                reason: format!("no pool of {}: {cause}", counted(threads, "thread")),
            })?;
        let count = threads.min(batch).max(1);
        let parts = (0..count)
            .map(|k| {
                let windows = (k + 1) * batch / count - k * batch / count;
                let shape = (frames + 1, windows, FEATURES);
                let features = Array3::from_shape_simple_fn(shape, || rng.random_range(-1.0..1.0));
                let poses = network.reads_poses().then(|| {
                    let mut poses = PoseWindows::zeros(frames + 1, windows);
                    let made_up = |_: f32| rng.random_range(-1.0..1.0);
                    poses.rotations.mapv_inplace(made_up);
                    poses
                });
                let batch = Batch {
                    poses,
                    ..Batch::of(features)
                };
                (batch, Workspace::new())
            })
            .collect();
        Ok(Self {
            network,
            parameters,
            pool,
            parts,
        })
    }

    /// Generates once and says how long it took.
    ///
    /// # Errors
    /// The network refuses its input.
    pub fn run(&mut self) -> Result<Duration, ModelError> {
        let (network, parameters) = (&self.network, &self.parameters);
        let parts = &mut self.parts;
        let start = Instant::now();
        self.pool
            .install(|| {
                parts.par_iter_mut().try_for_each(|(batch, workspace)| {
                    let mut tape = Tape::inference(parameters, workspace);
                    network.predict(&mut tape, batch).map(|_| ())
                })
            })
            .map_err(|cause| ModelError::Model {
                model: "generation".into(),
                reason: cause.to_string(),
            })?;
        Ok(start.elapsed())
    }
}

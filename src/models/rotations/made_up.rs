//! One step without end on windows of the built-in choreography, for timings.

use super::gradient_check::generated_batch;
use super::settings::build;
use super::trained::{Reference, TrainedRotations};
use super::{Batch, RotationNetwork, RotationSettings, WindowStatistics};
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::settings::InitialRng;
use crate::models::transition::parts;
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};
use crate::motion::rotation_window::Interpolation;
use crate::nn::Initialiser;

/// The very step that a training runs.
pub(super) struct MadeUpTask {
    network: std::sync::Arc<dyn RotationNetwork<f32>>,
    reference: Reference,
    statistics: WindowStatistics,
    shards: Vec<Batch<f32>>,
    windows: usize,
}

impl MadeUpTask {
    /// Steps on `batch` windows of `frames` frames.
    ///
    /// # Errors
    /// Sizes that do not fit together; fewer than 3 frames.
    pub fn new<S: RotationSettings>(
        settings: &S,
        frames: usize,
        batch: usize,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Self, ModelError> {
        let sample =
            |count, seed| generated_batch(settings, frames, count, seed, Interpolation::Slerp);
        let (_, body, _) = sample(1, streams.seed())?;
        let statistics = WindowStatistics::ones(&body);
        let network = build(settings, init, &body, &statistics)?;
        let count = settings.schedule().shards_of(batch);
        let shards = parts(batch, count).enumerate().map(|(k, range)| {
            let (shard, _, _) = sample(range.len(), streams.seed() + k as u64)?;
            Ok(Batch {
                total_windows: batch,
                ..shard.single()
            })
        });
        Ok(Self {
            shards: shards.collect::<Result<_, ModelError>>()?,
            network: network.into(),
            reference: Reference::new(body, settings)?,
            statistics,
            windows: batch,
        })
    }
}

impl Task<f32> for MadeUpTask {
    fn steps(&self) -> u64 {
        u64::MAX
    }

    fn frame_steps(&self) -> u64 {
        u64::MAX
    }

    fn step(&self, _step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(MadeUpStep(self))
    }

    fn statistics(&self) -> Statistics {
        let statistics = self.reference.body.statistics(Statistics::default());
        self.statistics.statistics(statistics)
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedRotations::new(name, network, parameters, reference))
    }
}

struct MadeUpStep<'t>(&'t MadeUpTask);

impl Step<f32> for MadeUpStep<'_> {
    fn shards(&self) -> usize {
        self.0.shards.len()
    }

    fn frames(&self) -> u64 {
        self.0.shards.iter().map(|shard| shard.rows() as u64).sum()
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        self.0.network.losses(tape, &self.0.shards[shard])
    }

    fn describe(&self) -> String {
        counted(self.0.windows, "made-up window")
    }
}

//! One step without end on windows of the built-in choreography, for timings.

use std::sync::Arc;

use super::batch::Batch;
use super::clips::MusicStatistics;
use super::config::Pu2022Settings;
use super::generator::{Reference, TrainedPu2022};
use super::network::Pu2022;
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::settings::InitialRng;
use crate::models::transition::parts;
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};
use crate::nn::Initialiser;

/// The very step that a training runs.
pub(super) struct MadeUpTask {
    network: Arc<Pu2022>,
    reference: Reference,
    shards: Vec<Batch<f32>>,
    frames: u64,
    windows: usize,
}

impl MadeUpTask {
    /// # Errors
    /// Sizes that do not fit together.
    pub fn new(
        settings: Pu2022Settings,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Self, ModelError> {
        let total = settings.schedule.batch_size;
        let (windows, body) = settings.made_up(total, streams.seed())?;
        let network = settings.build(init, body.joints())?;
        let (given, truths): (Vec<_>, Vec<_>) = windows.into_iter().unzip();
        let shards = parts(total, settings.schedule.shards()).map(|range| Batch {
            total_windows: total,
            ..Batch::of(
                &given[range.clone()],
                &truths[range],
                &settings.window,
                &settings.loss,
            )
        });
        let music = MusicStatistics::none(settings.music.features.numbers());
        Ok(Self {
            shards: shards.collect(),
            network: network.into(),
            reference: Reference::new(body, music, &settings)?,
            frames: (total * settings.window.generated()) as u64,
            windows: total,
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
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedPu2022::new(name, network, parameters, reference))
    }
}

struct MadeUpStep<'t>(&'t MadeUpTask);

impl Step<f32> for MadeUpStep<'_> {
    fn shards(&self) -> usize {
        self.0.shards.len()
    }

    fn frames(&self) -> u64 {
        self.0.frames
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        self.0.network.losses(tape, &self.0.shards[shard])
    }

    fn describe(&self) -> String {
        counted(self.0.windows, "made-up window")
    }
}

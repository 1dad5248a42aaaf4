//! A training small enough for tests: a one-layer recurrence on smooth made-up features.

use keydance::autograd::{AutogradError, BlockId, Parameters, Real, Tape};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::data::{Dataset, Recording};
use keydance::experiment::ExperimentConfig;
use keydance::models::settings::InitialRng;
use keydance::models::transition::{
    Batch, Forcing, Network, Schedule, TransitionSettings, TransitionTask,
};
use keydance::models::{LossTerms, Streams};
use keydance::motion::features::{FEATURES, FRAME};
use keydance::nn::Initialiser;
use keydance::optim::RateSchedule;
use keydance::training::{Trainer, TrainingError};
use ndarray::{Array3, Axis, s};

const HIDDEN: usize = 8;

/// Each frame from the one before through a hidden layer with dropout.
struct Recurrence {
    hidden: [BlockId; 2],
    output: [BlockId; 2],
}

impl Recurrence {
    fn new<T: Real, R: rand::Rng>(init: &mut Initialiser<'_, T, R>, hidden: usize) -> Self {
        let mut layer = |name: &str, outputs: usize, inputs: usize| {
            let bound = 1.0 / (inputs as f64).sqrt();
            [
                init.uniform(format!("{name}.weight"), &[outputs, inputs], bound)
                    .1,
                init.uniform(format!("{name}.bias"), &[outputs], bound).1,
            ]
        };
        Self {
            hidden: layer("hidden", hidden, FEATURES),
            output: layer("output", FEATURES, hidden),
        }
    }
}

impl<T: Real> Network<T> for Recurrence {
    fn losses(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        forcing: Forcing,
    ) -> Result<LossTerms, AutogradError> {
        let frames = batch.features.len_of(Axis(0));
        let frame = |t: usize| batch.features.index_axis(Axis(0), t).to_owned().into_dyn();
        let [w1, b1, w2, b2] = [
            self.hidden[0],
            self.hidden[1],
            self.output[0],
            self.output[1],
        ]
        .map(|block| tape.block(block));
        let mut current = tape.constant(frame(0));
        let mut sum = None;
        for t in 1..frames {
            let hidden = tape.linear(current, w1, Some(b1), false)?;
            let hidden = tape.tanh(hidden);
            let hidden = tape.dropout(hidden, 0.1);
            let next = tape.linear(hidden, w2, Some(b2), false)?;
            let truth = tape.constant(frame(t));
            let difference = tape.sub(next, truth)?;
            let square = tape.square(difference);
            let loss = tape.sum(square);
            sum = Some(match sum {
                None => loss,
                Some(sum) => tape.add(sum, loss)?,
            });
            current = match forcing {
                Forcing::Teacher => truth,
                Forcing::FreeRunning => next,
            };
        }
        let sum = match sum {
            Some(sum) => sum,
            None => tape.sum(current),
        };
        let count = (frames - 1) * batch.total_windows;
        let total = tape.affine(sum, 1.0 / count as f64, 0.0);
        Ok(LossTerms {
            total,
            critics: None,
            terms: vec![("reconstruction", total)],
            buffers: Vec::new(),
            watched: Vec::new(),
        })
    }

    fn predict(
        &self,
        _tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Array3<T>, AutogradError> {
        Ok(batch.features.slice(s![1.., .., ..FRAME]).to_owned())
    }
}

/// The network's parameters with this many hidden units.
pub fn parameters(hidden: usize) -> Parameters<f32> {
    let mut parameters = Parameters::new();
    let rng = Streams::new(9).initialisation();
    Recurrence::new(&mut Initialiser::new(&mut parameters, rng), hidden);
    parameters
}

/// Three clips of unlike lengths to train on, one to test on.
pub fn dataset() -> Dataset {
    let choreography = ChoreographyConfig {
        clips: 4,
        frames_per_clip: 80,
        seed: 7,
    };
    let clips = generate(&choreography).unwrap();
    let mut recordings: Vec<Recording> = clips
        .into_iter()
        .zip([60, 35, 80, 40])
        .map(|(generated, frames)| {
            let mut clip = generated.clip;
            clip.poses.truncate(frames);
            Recording::of(clip)
        })
        .collect();
    let test = recordings.split_off(3);
    Dataset {
        train: recordings,
        test,
        digest: "synthetic".into(),
        ..Dataset::default()
    }
}

/// The part of a config that is a transition model's own.
pub fn settings(config: &mut ExperimentConfig) -> &mut TransitionSettings {
    TransitionSettings::of_mut(config).unwrap()
}

/// Four epochs of transitions of 3 to 6 frames in batches of 13, some 60 steps.
pub fn config() -> ExperimentConfig {
    let mut config = ExperimentConfig::default();
    let own = settings(&mut config);
    own.schedule.min_len = 3;
    own.schedule.max_len = 6;
    own.schedule.min_len_step = 1;
    own.schedule.min_len_every = 2;
    own.schedule.batch_size = 13;
    own.schedule.fraction = 0.6;
    own.scheduled_sampling.decay = 0.7;
    config.optimiser.learning_rate = 0.01;
    config.optimiser.rate_schedule = Some(RateSchedule {
        warmup_steps: 3,
        final_share: 0.2,
        ..RateSchedule::default()
    });
    config.checkpoint.every_steps = 10;
    config
}

pub fn trainer(data: &Dataset, threads: usize) -> Trainer<'_> {
    trainer_of(config(), data, threads)
}

pub fn trainer_of(config: ExperimentConfig, data: &Dataset, threads: usize) -> Trainer<'_> {
    try_trainer(config, data, threads).unwrap()
}

pub fn try_trainer(
    config: ExperimentConfig,
    data: &Dataset,
    threads: usize,
) -> Result<Trainer<'_>, TrainingError> {
    trainer_of_network(config, data, threads, |init| {
        Box::new(Recurrence::new(init, HIDDEN))
    })
}

/// The training of a network that no config describes.
pub fn trainer_of_network<'d>(
    config: ExperimentConfig,
    data: &'d Dataset,
    threads: usize,
    build: impl FnOnce(&mut Initialiser<'_, f32, InitialRng>) -> Box<dyn Network<f32>>,
) -> Result<Trainer<'d>, TrainingError> {
    let own = TransitionSettings::of(&config).unwrap().clone();
    Trainer::with_task(config, data, threads, |setting, init| {
        let clips = setting.dataset.training_clips();
        let task = TransitionTask::new(&own, setting, clips, |_| Ok(build(init)))?;
        Ok(Box::new(task))
    })
}

/// The curriculum of a training on the data.
pub fn schedule(config: &ExperimentConfig, data: &Dataset) -> Schedule {
    let frames: Vec<usize> = data.train.iter().map(Recording::frames).collect();
    let own = TransitionSettings::of(config).unwrap();
    Schedule::new(&frames, &own.schedule, Streams::new(config.seed))
}

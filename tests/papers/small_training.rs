//! A training small enough for tests: a one-layer recurrence on smooth made-up features.

use keydance::autograd::{AutogradError, BlockId, Parameters, Real, Tape};
use keydance::data::{DanceClip, Dataset};
use keydance::experiment::ExperimentConfig;
use keydance::models::LossTerms;
use keydance::models::transition::{Batch, Feed, Network};
use keydance::motion::features::{FEATURES, FRAME};
use keydance::motion::{Clip, Skeleton};
use keydance::nn::Initialiser;
use keydance::optim::RateSchedule;
use keydance::training::{Trainer, TrainingError};
use ndarray::{Array2, Array3, Axis, s};

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
        feed: Feed,
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
            current = match feed {
                Feed::GroundTruth => truth,
                Feed::Predictions => next,
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
    let rng = keydance::models::Streams::new(9).initialisation();
    Recurrence::new(&mut Initialiser::new(&mut parameters, rng), hidden);
    parameters
}

/// Three clips of unlike lengths.
pub fn dataset() -> Dataset {
    let clip = |k: usize, frames: usize| DanceClip {
        name: format!("{k}.bvh"),
        features: Array2::from_shape_fn((frames, FEATURES), |(t, i)| {
            let speed = 0.05 + 0.01 * (i % 7) as f64;
            ((t as f64 + 3.0 * k as f64) * speed + i as f64).sin() * (1.0 + i as f64)
        }),
        clip: Clip {
            name: format!("{k}.bvh"),
            skeleton: Skeleton { joints: Vec::new() },
            frame_time: 1.0 / 30.0,
            poses: Vec::new(),
        },
    };
    Dataset {
        train: vec![clip(0, 60), clip(1, 35), clip(2, 80)],
        validation: Vec::new(),
        test: vec![clip(3, 40)],
        digest: "synthetic".into(),
    }
}

/// Four epochs of transitions of 3 to 6 frames in batches of 13, some 60 steps.
pub fn config() -> ExperimentConfig {
    let mut config = ExperimentConfig::default();
    config.schedule.min_len = 3;
    config.schedule.max_len = 6;
    config.schedule.min_len_step = 1;
    config.schedule.min_len_every = 2;
    config.schedule.batch_size = 13;
    config.schedule.fraction = 0.6;
    config.optimiser.learning_rate = 0.01;
    config.optimiser.rate_schedule = Some(RateSchedule {
        warmup_steps: 3,
        final_share: 0.2,
        ..RateSchedule::default()
    });
    config.scheduled_sampling.decay = 0.7;
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
    Trainer::with_network(config, data, threads, |init, _| {
        Ok(Box::new(Recurrence::new(init, HIDDEN)))
    })
}

//! The training: sequences of the training pieces, shuffled anew in every epoch.

use std::ops::Range;
use std::sync::Arc;

use ndarray::{Array2, ArrayView2, s};
use rand::RngExt as _;
use serde_json::{Map, Value};

use super::config::{MoglowConfig, MoglowSettings};
use super::flow::{Moglow2020, SequenceBatch};
use super::generator::{Reference, TrainedMoglow};
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::dance_features::TrainingWindows;
use crate::models::settings::{InitialRng, TaskSetting};
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Task};
use crate::nn::Initialiser;

/// The training of a network on dances with their music.
pub struct MoglowTask {
    settings: MoglowSettings,
    network: Arc<Moglow2020>,
    reference: Reference,
    windows: TrainingWindows,
}

/// What a sequence is made of: motion from `motion_past` frames before it to its end, and music from
/// `audio_past` frames before it to `audio_future` - 1 behind.
pub(super) struct Sequence<'s> {
    /// Of what is known; masked frames are 0.
    pub known: Array2<f32>,
    pub motion: Array2<f32>,
    pub audio: ArrayView2<'s, f32>,
}

/// Sequences of `frames` frames beside each other, frame by frame.
pub(super) fn sequence_batch(
    config: &MoglowConfig,
    sequences: &[Sequence<'_>],
    frames: usize,
    total_sequences: usize,
) -> SequenceBatch<f32> {
    let count = sequences.len();
    let widths = sequences
        .first()
        .map_or((0, 0), |it| (it.motion.ncols(), it.audio.ncols()));
    let (past, heard) = (config.motion_past, config.audio_past + config.audio_future);
    let mut condition = Array2::zeros((frames * count, config.condition(widths.0, widths.1)));
    let mut target = Array2::zeros((frames * count, widths.0));
    for (k, sequence) in sequences.iter().enumerate() {
        for frame in 0..frames {
            let row = frame * count + k;
            target
                .row_mut(row)
                .assign(&sequence.motion.row(past + frame));
            let motion = sequence.known.slice(s![frame..frame + past, ..]);
            let audio = sequence.audio.slice(s![frame..frame + heard, ..]);
            let mut out = condition.row_mut(row);
            let numbers = motion.iter().chain(audio.iter());
            out.iter_mut().zip(numbers).for_each(|(out, &x)| *out = x);
        }
    }
    SequenceBatch {
        condition,
        target,
        sequences: count,
        total_sequences,
    }
}

impl MoglowTask {
    /// # Errors
    /// Clips of other joints or rates, without music, or too short for a sequence; fewer sequences
    /// than a batch has.
    pub fn new(
        settings: &MoglowSettings,
        setting: &TaskSetting<'_>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Self, ModelError> {
        let known = setting.start.map(|start| Reference::saved(start, settings));
        let known = known
            .transpose()
            .map_err(|error| ModelError::data(&error))?;
        let (windows, features) = TrainingWindows::new(
            setting,
            known.map(|known| known.features),
            &settings.features,
            &settings.augmentation,
            &settings.schedule,
            settings.model.sequence_contexts(),
        )?;
        let (motion, audio) = features.widths();
        let task = Self {
            network: settings.build(init, motion, audio)?.into(),
            reference: Reference::new(features, settings),
            settings: settings.clone(),
            windows,
        };
        let first = task.batch(0, 0..task.windows.batch());
        let started = task.network.start(init.parameters_mut(), &first);
        started.map_err(|error| ModelError::data(&error))?;
        Ok(task)
    }

    /// Sequences of a step.
    fn batch(&self, step: u64, range: Range<usize>) -> SequenceBatch<f32> {
        let dropout = self.settings.model.pose_dropout;
        let windows = self.windows.of(step, range).into_iter();
        let sequences = windows.map(|window| {
            let mut known = window.motion.clone();
            if dropout > 0.0 {
                let streams = self.windows.streams();
                let mut rng = streams.stream("pose_dropout", &[step, window.number]);
                for mut frame in known.rows_mut() {
                    if rng.random::<f64>() < dropout {
                        frame.fill(0.0);
                    }
                }
            }
            Sequence {
                known,
                motion: window.motion,
                audio: window.audio,
            }
        });
        let sequences: Vec<Sequence<'_>> = sequences.collect();
        let model = &self.settings.model;
        sequence_batch(model, &sequences, model.sequence, self.windows.batch())
    }
}

impl Task<f32> for MoglowTask {
    fn steps(&self) -> u64 {
        self.windows.steps()
    }

    fn frame_steps(&self) -> u64 {
        self.steps() * self.windows.frames()
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(MoglowStep { task: self, step })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        self.windows.place(step)
    }

    fn statistics(&self) -> Statistics {
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedMoglow::new(name, network, parameters, reference))
    }

    fn summary(&self) -> Option<String> {
        Some(self.windows.summary())
    }

    fn warnings(&self) -> Vec<String> {
        self.windows.warnings().to_vec()
    }

    fn facts(&self) -> Map<String, Value> {
        self.windows.facts(&self.reference.features)
    }
}

/// A step of the training.
struct MoglowStep<'t> {
    task: &'t MoglowTask,
    step: u64,
}

impl Step<f32> for MoglowStep<'_> {
    fn shards(&self) -> usize {
        self.task.windows.shards()
    }

    fn frames(&self) -> u64 {
        self.task.windows.frames()
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let sequences = self.task.windows.shard(shard);
        let batch = self.task.batch(self.step, sequences);
        self.task.network.losses(tape, &batch)
    }

    fn describe(&self) -> String {
        let frames = self.task.settings.model.sequence;
        let sequences = counted(self.task.windows.batch(), "sequence");
        format!("{sequences} of {}", counted(frames, "frame"))
    }
}

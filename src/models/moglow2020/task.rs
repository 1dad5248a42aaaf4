//! The training: sequences of the training pieces, shuffled anew in every epoch.

use std::ops::Range;
use std::sync::Arc;

use ndarray::{Array2, ArrayView2, s};
use rand::RngExt as _;
use serde_json::{Map, Value, json};

use super::config::{MoglowConfig, MoglowSettings};
use super::flow::{Moglow2020, SequenceBatch};
use super::generator::{Reference, TrainedMoglow};
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::dance_features::{DanceData, Epochs, Piece, with_noise};
use crate::models::settings::{InitialRng, TaskSetting};
use crate::models::transition::parts;
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};
use crate::nn::Initialiser;

/// The training of a network on dances with their music.
pub struct MoglowTask {
    settings: MoglowSettings,
    network: Arc<Moglow2020>,
    reference: Reference,
    pieces: Vec<Piece>,
    epochs: Epochs,
    streams: Streams,
    warnings: Vec<String>,
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
        let mirror = settings.augmentation.mirror;
        let known = setting.start.map(|start| Reference::saved(start, settings));
        let known = known
            .transpose()
            .map_err(|error| ModelError::data(&error))?;
        let mut data = match known {
            Some(known) => DanceData::in_numbers(known.features, setting.dataset, mirror)?,
            None => DanceData::of(setting.dataset, &settings.features, mirror)?,
        };
        data.keep(&settings.schedule.clips)?;
        let DanceData {
            features,
            train,
            warnings,
            ..
        } = data;
        let frames: Vec<usize> = train.iter().map(Piece::frames).collect();
        let contexts = settings.model.sequence_contexts();
        let batch = settings.schedule.batch_size;
        let epochs = Epochs::new(&frames, contexts, batch, setting.streams)?;
        let (motion, audio) = features.widths();
        let task = Self {
            network: settings.build(init, motion, audio)?.into(),
            reference: Reference::new(features, settings),
            settings: settings.clone(),
            pieces: train,
            epochs,
            streams: setting.streams,
            warnings,
        };
        let first = task.batch(0, 0..batch);
        let started = task.network.start(init.parameters_mut(), &first);
        started.map_err(|error| ModelError::data(&error))?;
        Ok(task)
    }

    /// Sequences of a step.
    fn batch(&self, step: u64, range: Range<usize>) -> SequenceBatch<f32> {
        let contexts = self.settings.model.sequence_contexts();
        let dropout = self.settings.model.pose_dropout;
        let noise = self.settings.augmentation.target_noise;
        let windows = self.epochs.batch(step);
        let windows = windows.iter().enumerate();
        let sequences = windows
            .skip(range.start)
            .take(range.len())
            .map(|(index, at)| {
                let piece = &self.pieces[at.piece];
                let rows = at.frame - contexts.motion..at.frame + contexts.predicted;
                let indices = [step, index as u64];
                let mut rng = self.streams.stream("target_noise", &indices);
                let motion = with_noise(piece.motion.slice(s![rows, ..]), noise, &mut rng);
                let mut known = motion.clone();
                if dropout > 0.0 {
                    let mut rng = self.streams.stream("pose_dropout", &indices);
                    for mut frame in known.rows_mut() {
                        if rng.random::<f64>() < dropout {
                            frame.fill(0.0);
                        }
                    }
                }
                Sequence {
                    known,
                    motion,
                    audio: piece.audio.slice(s![contexts.audio_rows(at.frame), ..]),
                }
            });
        let sequences: Vec<Sequence<'_>> = sequences.collect();
        let model = &self.settings.model;
        let total = self.settings.schedule.batch_size;
        sequence_batch(model, &sequences, model.sequence, total)
    }
}

impl Task<f32> for MoglowTask {
    fn steps(&self) -> u64 {
        self.settings.schedule.steps
    }

    fn frame_steps(&self) -> u64 {
        let frames = self.settings.schedule.batch_size * self.settings.model.sequence;
        self.settings.schedule.steps * frames as u64
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(MoglowStep { task: self, step })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        self.epochs.place(step)
    }

    fn statistics(&self) -> Statistics {
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedMoglow::new(name, network, parameters, reference))
    }

    fn summary(&self) -> Option<String> {
        let epoch = self.epochs.batches() as u64;
        let epochs = self.settings.schedule.steps as f64 / epoch as f64;
        Some(format!("{epochs:.1} epochs of {epoch} steps"))
    }

    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    fn facts(&self) -> Map<String, Value> {
        let features = &self.reference.features;
        Map::from_iter([
            ("training_windows".into(), json!(self.epochs.windows())),
            ("motion_columns".into(), json!(features.widths().0)),
            ("audio_columns".into(), json!(features.widths().1)),
            ("bits_of_deviations".into(), json!(features.motion.bits())),
        ])
    }
}

/// A step of the training.
struct MoglowStep<'t> {
    task: &'t MoglowTask,
    step: u64,
}

impl Step<f32> for MoglowStep<'_> {
    fn shards(&self) -> usize {
        self.task.settings.schedule.shards()
    }

    fn frames(&self) -> u64 {
        let settings = &self.task.settings;
        (settings.schedule.batch_size * settings.model.sequence) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let total = self.task.settings.schedule.batch_size;
        let range = parts(total, self.shards()).nth(shard).unwrap_or(0..0);
        self.task
            .network
            .losses(tape, &self.task.batch(self.step, range))
    }

    fn describe(&self) -> String {
        let settings = &self.task.settings;
        let sequences = counted(settings.schedule.batch_size, "sequence");
        format!(
            "{sequences} of {}",
            counted(settings.model.sequence, "frame")
        )
    }
}

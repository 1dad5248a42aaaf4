//! What trainings on windows of dances share, whatever the network.

use std::ops::Range;

use ndarray::{Array2, ArrayView2, s};
use serde_json::{Map, Value, json};

use super::config::{AugmentationConfig, FeaturesConfig, ScheduleConfig};
use super::epochs::Epochs;
use super::features::DanceFeatures;
use super::pieces::{DanceData, Piece, with_noise};
use super::windows::Contexts;
use crate::models::settings::TaskSetting;
use crate::models::transition::parts;
use crate::models::{ModelError, Streams};

/// The windows of the training pieces, shuffled anew in every epoch (spec, sections 1 and 6).
pub struct TrainingWindows {
    contexts: Contexts,
    schedule: ScheduleConfig,
    /// `augmentation.target_noise`
    noise: f64,
    pieces: Vec<Piece>,
    epochs: Epochs,
    streams: Streams,
    warnings: Vec<String>,
}

/// One window of a step, as training sees it.
pub struct TrainingWindow<'w> {
    /// Its number in the step.
    pub number: u64,
    /// What is known, then what is predicted, with noise: `[contexts.motion + N, D]`.
    pub motion: Array2<f32>,
    /// `[contexts.audio_past + contexts.audio_future, A]`
    pub audio: ArrayView2<'w, f32>,
}

impl TrainingWindows {
    /// Of a data set in numbers that are `known`, else fitted to it; with these numbers.
    ///
    /// # Errors
    /// Clips of other joints or rates, without music, or too short for a window; fewer windows than
    /// a batch has; clips in the schedule that there are not.
    pub fn new(
        setting: &TaskSetting<'_>,
        known: Option<DanceFeatures>,
        features: &FeaturesConfig,
        augmentation: &AugmentationConfig,
        schedule: &ScheduleConfig,
        contexts: Contexts,
    ) -> Result<(Self, DanceFeatures), ModelError> {
        let mut data = match known {
            Some(known) => DanceData::in_numbers(known, setting.dataset, augmentation.mirror)?,
            None => DanceData::of(setting.dataset, features, augmentation.mirror)?,
        };
        data.keep(&schedule.clips)?;
        let frames: Vec<usize> = data.train.iter().map(Piece::frames).collect();
        let windows = Self {
            contexts,
            noise: augmentation.target_noise,
            epochs: Epochs::new(&frames, contexts, schedule.batch_size, setting.streams)?,
            schedule: schedule.clone(),
            pieces: data.train,
            streams: setting.streams,
            warnings: data.warnings,
        };
        Ok((windows, data.features))
    }

    /// Motion of every piece with the noise that `name` draws, `[frames, D]`.
    pub fn seen(&self, name: &str) -> Vec<Array2<f32>> {
        let pieces = self.pieces.iter().enumerate();
        let seen = pieces.map(|(index, piece)| {
            let mut rng = self.streams.stream(name, &[index as u64]);
            with_noise(piece.motion.view(), self.noise, &mut rng)
        });
        seen.collect()
    }

    /// Windows of a step.
    pub fn of(&self, step: u64, range: Range<usize>) -> Vec<TrainingWindow<'_>> {
        let windows = self.epochs.batch(step);
        let windows = windows.into_iter().enumerate();
        let windows = windows.skip(range.start).take(range.len());
        let windows = windows.map(|(number, at)| {
            let piece = &self.pieces[at.piece];
            let rows = at.frame - self.contexts.motion..at.frame + self.contexts.predicted;
            let number = number as u64;
            let mut rng = self.streams.stream("target_noise", &[step, number]);
            let audio = self.contexts.audio_rows(at.frame);
            TrainingWindow {
                number,
                motion: with_noise(piece.motion.slice(s![rows, ..]), self.noise, &mut rng),
                audio: piece.audio.slice(s![audio, ..]),
            }
        });
        windows.collect()
    }

    /// What random numbers of the training follow from.
    pub fn streams(&self) -> Streams {
        self.streams
    }

    /// Windows of a batch.
    pub fn batch(&self) -> usize {
        self.schedule.batch_size
    }

    /// Parts of a batch.
    pub fn shards(&self) -> usize {
        self.schedule.shards()
    }

    /// Windows of a shard.
    pub fn shard(&self, shard: usize) -> Range<usize> {
        let shards = parts(self.batch(), self.shards());
        shards.into_iter().nth(shard).unwrap_or(0..0)
    }

    /// Steps of the training.
    pub fn steps(&self) -> u64 {
        self.schedule.steps
    }

    /// Frames that a step trains.
    pub fn frames(&self) -> u64 {
        (self.batch() * self.contexts.predicted) as u64
    }

    /// Epoch and batch in it of a step.
    pub fn place(&self, step: u64) -> [u64; 2] {
        self.epochs.place(step)
    }

    /// The size of the schedule in words.
    pub fn summary(&self) -> String {
        let epoch = self.epochs.batches() as u64;
        let epochs = self.steps() as f64 / epoch as f64;
        format!("{epochs:.1} epochs of {epoch} steps")
    }

    /// What a person should know before the training begins.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// What a manifest keeps of it.
    pub fn facts(&self, features: &DanceFeatures) -> Map<String, Value> {
        let (motion, audio) = features.widths();
        Map::from_iter([
            ("training_windows".into(), json!(self.epochs.windows())),
            ("motion_columns".into(), json!(motion)),
            ("audio_columns".into(), json!(audio)),
            // What bits of standardised numbers lack to those in cm and rad.
            ("bits_of_deviations".into(), json!(features.motion.bits())),
        ])
    }
}

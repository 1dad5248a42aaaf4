//! The tables of a config that are this model's. The defaults are those that Valle-Pérez et al.
//! compare with.

use serde::{Deserialize, Serialize};

use crate::models::dance_features::{
    AugmentationConfig, Contexts, FeaturesConfig, GenerationConfig, ScheduleConfig,
};
use crate::models::settings::ValueError;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MoglowSettings {
    pub model: MoglowConfig,
    pub features: FeaturesConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
    pub generation: GenerationConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MoglowConfig {
    /// "moglow2020".
    pub kind: String,
    /// K.
    pub blocks: usize,
    /// H, numbers of an LSTM layer's output.
    pub hidden: usize,
    /// LSTM layers of a coupling.
    pub lstm_layers: usize,
    /// Frames of a seed, of which those behind the first `motion_past` run through the state.
    pub motion_context: usize,
    /// Frames of motion before a frame that are known.
    pub motion_past: usize,
    /// Frames of music before a frame that are heard, and from it on.
    pub audio_past: usize,
    pub audio_future: usize,
    /// Frames of a training sequence.
    pub sequence: usize,
    /// Probability that a known frame of motion is masked in training.
    pub pose_dropout: f64,
}

impl Default for MoglowConfig {
    fn default() -> Self {
        Self {
            kind: "moglow2020".into(),
            blocks: 16,
            hidden: 512,
            lstm_layers: 2,
            motion_context: 120,
            motion_past: 40,
            audio_past: 40,
            audio_future: 10,
            sequence: 80,
            pose_dropout: 0.0,
        }
    }
}

impl MoglowConfig {
    /// Numbers that a frame is conditioned on, for D of motion and A of music a frame.
    pub fn condition(&self, motion: usize, audio: usize) -> usize {
        motion * self.motion_past + audio * (self.audio_past + self.audio_future)
    }

    /// What a sequence of frames reads and predicts, as one window.
    pub fn sequence_contexts(&self) -> Contexts {
        Contexts {
            motion: self.motion_past,
            audio_past: self.audio_past,
            audio_future: self.sequence - 1 + self.audio_future,
            predicted: self.sequence,
        }
    }
}

impl MoglowSettings {
    /// # Errors
    /// The first value out of its range.
    pub(super) fn check_values(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        let model = &self.model;
        within("model.blocks", model.blocks, 1, 256)?;
        within("model.hidden", model.hidden, 1, 65_536)?;
        within("model.lstm_layers", model.lstm_layers, 1, 64)?;
        within("model.motion_past", model.motion_past, 1, 1000)?;
        let context = model.motion_context;
        within("model.motion_context", context, model.motion_past, 10_000)?;
        // A sequence begins where its first frame has all that it knows.
        within("model.audio_past", model.audio_past, 0, model.motion_past)?;
        within("model.audio_future", model.audio_future, 1, 1000)?;
        within("model.sequence", model.sequence, 1, 10_000)?;
        let share = (0.0..1.0).contains(&model.pose_dropout);
        let dropout = model.pose_dropout;
        ValueError::unless(share, "model.pose_dropout", dropout, "0 to below 1")?;
        self.schedule.check()?;
        self.augmentation.check()?;
        self.generation.check()
    }
}

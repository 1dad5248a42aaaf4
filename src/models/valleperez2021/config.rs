//! The tables of a config that are this model's. The defaults are the paper's.

use serde::{Deserialize, Serialize};

use crate::models::flow::NormKind;
use crate::models::settings::ValueError;
use crate::nn::Positions;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValleperezSettings {
    pub model: ValleperezConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
    pub generation: GenerationConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValleperezConfig {
    /// "valleperez2021".
    pub kind: String,
    /// A flow, or one number a channel: the deterministic baseline.
    pub head: Head,
    /// Numbers of a token of the encoders.
    pub width: usize,
    pub heads: usize,
    pub feed_forward: usize,
    /// Layers of the motion encoder, the audio encoder and the cross-modal encoder (L_mo, L_mu,
    /// L_cm).
    pub motion_layers: usize,
    pub audio_layers: usize,
    pub cross_layers: usize,
    /// k_x, frames of past motion that are known.
    pub motion_context: usize,
    /// k_m, frames of past music that are heard.
    pub audio_past: usize,
    /// l_m, frames of music from the predicted frame on.
    pub audio_future: usize,
    /// N, frames that are predicted together.
    pub predicted_frames: usize,
    pub positions: Positions,
    pub cross_positions: CrossPositions,
    /// K.
    pub blocks: usize,
    /// Sizes of the Transformer of a coupling, and its layers (L_ac).
    pub flow_width: usize,
    pub flow_heads: usize,
    pub flow_feed_forward: usize,
    pub coupling_layers: usize,
    pub norm: NormKind,
    /// What of a frame is predicted.
    pub target: TargetKind,
    /// W of the first block before training.
    pub linear_init: LinearInit,
    /// Couplings that change nothing before training.
    pub zero_couplings: bool,
}

/// What the encoder's output becomes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Head {
    Flow,
    Deterministic,
}

/// Where a token of the cross-modal encoder stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CrossPositions {
    /// At its index, audio behind motion.
    Index,
    /// At its frame, with a bias for each pair of modalities.
    Aligned,
}

/// What the flow models of the next frames, in the place of the frames themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetKind {
    /// The standardised frames.
    Pose,
    /// Their difference from the frame before.
    Difference,
    /// What a linear regression on the three frames before leaves.
    Linear,
}

/// W of the first block before training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinearInit {
    /// A random rotation, as in every other block.
    Orthogonal,
    /// What makes the channels of the training part's targets independent.
    Whitening,
}

/// `[schedule]`
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    pub steps: u64,
    /// Windows of a step.
    pub batch_size: usize,
    /// Parts that a batch is computed in; 1 where norms need the whole batch.
    pub shards: usize,
}

/// `[augmentation]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Mirror images are trained, too.
    pub mirror: bool,
    /// Exponential maps are taken from the training part's mean rotations.
    pub centre_rotations: bool,
    /// Deviation of the noise on training targets and motion context, deviations of the data.
    pub target_noise: f64,
}

/// `[generation]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GenerationConfig {
    /// tau, deviation of the noise that dances are made from.
    pub temperature: f64,
    /// Bound of what is fed back, deviations; none: unbounded, and beyond 10 an error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clamp: Option<f64>,
    /// Behind the end of the music its last frame is heard on.
    pub pad_audio: bool,
}

impl Default for ValleperezConfig {
    fn default() -> Self {
        Self {
            kind: "valleperez2021".into(),
            head: Head::Flow,
            width: 800,
            heads: 10,
            feed_forward: 800,
            motion_layers: 2,
            audio_layers: 2,
            cross_layers: 12,
            motion_context: 120,
            audio_past: 120,
            audio_future: 20,
            predicted_frames: 3,
            positions: Positions::T5,
            cross_positions: CrossPositions::Index,
            blocks: 16,
            flow_width: 512,
            flow_heads: 8,
            flow_feed_forward: 512,
            coupling_layers: 2,
            norm: NormKind::Batch,
            target: TargetKind::Pose,
            linear_init: LinearInit::Orthogonal,
            zero_couplings: false,
        }
    }
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            steps: 600_000,
            batch_size: 336,
            shards: 1,
        }
    }
}

impl Default for AugmentationConfig {
    fn default() -> Self {
        Self {
            mirror: true,
            centre_rotations: false,
            target_noise: 0.0,
        }
    }
}

impl Default for GenerationConfig {
    fn default() -> Self {
        Self {
            temperature: 1.0,
            clamp: None,
            pad_audio: true,
        }
    }
}

impl ValleperezConfig {
    /// Frames of music that a window hears.
    pub fn audio_frames(&self) -> usize {
        self.audio_past + self.audio_future
    }
}

impl ValleperezSettings {
    /// # Errors
    /// The first value out of its range.
    pub(super) fn check_values(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        let model = &self.model;
        let divides = |key: &str, width: usize, heads: usize| {
            let expected = format!("a multiple of its {heads} heads");
            ValueError::unless(width.is_multiple_of(heads), key, width, expected)
        };
        within("model.heads", model.heads, 1, 1024)?;
        within("model.width", model.width, 1, 65_536)?;
        divides("model.width", model.width, model.heads)?;
        within("model.feed_forward", model.feed_forward, 1, 65_536)?;
        within("model.motion_layers", model.motion_layers, 0, 64)?;
        within("model.audio_layers", model.audio_layers, 0, 64)?;
        within("model.cross_layers", model.cross_layers, 0, 64)?;
        // Three frames are what `target = "linear"` looks back on.
        within("model.motion_context", model.motion_context, 3, 10_000)?;
        within("model.audio_past", model.audio_past, 0, 10_000)?;
        within("model.audio_future", model.audio_future, 1, 10_000)?;
        let (frames, known) = (model.predicted_frames, model.motion_context);
        let tokens = known + model.audio_frames();
        within("model.predicted_frames", frames, 1, tokens.min(1000))?;
        within("model.blocks", model.blocks, 1, 256)?;
        within("model.flow_heads", model.flow_heads, 1, 1024)?;
        within("model.flow_width", model.flow_width, 1, 65_536)?;
        divides("model.flow_width", model.flow_width, model.flow_heads)?;
        within(
            "model.flow_feed_forward",
            model.flow_feed_forward,
            1,
            65_536,
        )?;
        within("model.coupling_layers", model.coupling_layers, 0, 64)?;
        let own = model.head == Head::Flow || model.target == TargetKind::Pose;
        let expected = "\"pose\" where model.head is \"deterministic\"";
        ValueError::unless(own, "model.target", "another", expected)?;
        let schedule = &self.schedule;
        ValueError::unless(schedule.steps > 0, "schedule.steps", 0, "at least 1")?;
        within("schedule.batch_size", schedule.batch_size, 1, 65_536)?;
        within("schedule.shards", schedule.shards, 1, schedule.batch_size)?;
        let whole = model.head == Head::Deterministic || model.norm == NormKind::Act;
        let expected = "1 where model.norm is \"batch\": its statistics are those of a whole batch";
        let shards = schedule.shards;
        ValueError::unless(whole || shards == 1, "schedule.shards", shards, expected)?;
        let noise = self.augmentation.target_noise;
        let usable = noise.is_finite() && noise >= 0.0;
        ValueError::unless(usable, "augmentation.target_noise", noise, "0 or more")?;
        let GenerationConfig {
            temperature, clamp, ..
        } = self.generation;
        let usable = temperature.is_finite() && temperature >= 0.0;
        ValueError::unless(usable, "generation.temperature", temperature, "0 or more")?;
        let clamp = clamp.unwrap_or(1.0);
        let usable = clamp.is_finite() && clamp > 0.0;
        ValueError::unless(usable, "generation.clamp", clamp, "more than 0")
    }
}

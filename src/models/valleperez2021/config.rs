//! The tables of a config that are this model's. The defaults are the paper's.

use serde::{Deserialize, Serialize};

use crate::models::dance_features::{
    AugmentationConfig, Contexts, FeaturesConfig, GenerationConfig, ScheduleConfig,
};
use crate::models::flow::NormKind;
use crate::models::settings::ValueError;
use crate::nn::Positions;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ValleperezSettings {
    pub model: ValleperezConfig,
    pub features: FeaturesConfig,
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
    /// Whether it hears: without, the numbers of the music are 0.
    pub music: bool,
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
            music: true,
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

impl ValleperezConfig {
    /// Frames of music that a window hears.
    pub fn audio_frames(&self) -> usize {
        self.audio_past + self.audio_future
    }

    /// What a window reads and predicts.
    pub fn contexts(&self) -> Contexts {
        Contexts {
            motion: self.motion_context,
            audio_past: self.audio_past,
            audio_future: self.audio_future,
            predicted: self.predicted_frames,
        }
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
        self.schedule.check()?;
        self.augmentation.check()?;
        self.generation.check()
    }
}

//! The tables of a config that are this model's. The defaults are the paper's light model with what
//! the specification decides where the paper is silent.

use serde::{Deserialize, Serialize};

use crate::models::Shards;
use crate::models::settings::ValueError;
use crate::music::FeatureSet;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pu2022Settings {
    pub model: Pu2022Config,
    pub music: MusicConfig,
    pub window: WindowConfig,
    pub loss: LossConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pu2022Config {
    /// "pu2022".
    pub kind: String,
    /// d, numbers of a token.
    pub width: usize,
    pub heads: usize,
    /// Layers of the motion encoder, the music encoder and the cross-modal Transformer.
    pub motion_layers: usize,
    pub music_layers: usize,
    pub cross_layers: usize,
    pub feed_forward: usize,
    pub dropout: f64,
    pub norm: Norm,
    pub music_span: MusicSpan,
    /// l_t (eq. 8 to 10).
    pub local_positions: bool,
    /// e_t (eq. 5 and 6).
    pub key_pose_embedding: bool,
    /// P in the cross-modal Transformer; the encoders have theirs in any case.
    pub ordinary_positions: bool,
    /// Whether it hears: without, the numbers of the music are 0.
    pub music: bool,
}

/// Where a layer normalises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Norm {
    /// After each branch, as in the Transformer that the paper cites.
    Post,
    /// Before, with one more after each of the three stacks.
    Pre,
}

/// Which tokens of the music go on into the cross-modal Transformer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MusicSpan {
    /// Those of the frames that are generated.
    Future,
    /// All.
    Whole,
}

/// `[music]`
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MusicConfig {
    pub features: FeatureSet,
}

/// `[window]`, frames.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindowConfig {
    /// T'.
    pub seed: usize,
    /// T, the seed included.
    pub length: usize,
}

/// `[loss]`: the weights of frames near key poses (eq. 15), of the root and of velocities; the
/// paper has the first alone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// How much a key frame weighs more than one far from all.
    pub lambda: f64,
    /// How far that reaches, as a share of the T - T' frames.
    pub sigma: f64,
    /// How much the squared error of the root's place, m^2, weighs beside those of the rotations.
    pub root_weight: f64,
    /// How much the squared error of the change from frame to frame weighs beside that of a frame.
    pub velocity_weight: f64,
}

/// `[schedule]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    pub steps: u64,
    /// Windows of a step.
    pub batch_size: usize,
    /// Parts that a batch is computed in.
    pub shards: Shards,
    /// Most key poses of a window; as many are drawn, from none to these.
    pub key_poses: usize,
    /// Least frames from one to the next.
    pub key_pose_distance: usize,
}

/// What is trained beside the recorded windows; the paper trains nothing else.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Each window is with probability 1/2 the one that a mirror shows.
    pub mirror: bool,
}

impl Default for Pu2022Config {
    fn default() -> Self {
        Self {
            kind: "pu2022".into(),
            width: 256,
            heads: 4,
            motion_layers: 4,
            music_layers: 4,
            cross_layers: 8,
            feed_forward: 1024,
            dropout: 0.1,
            norm: Norm::Post,
            music_span: MusicSpan::Future,
            local_positions: true,
            key_pose_embedding: true,
            ordinary_positions: true,
            music: true,
        }
    }
}

impl Default for WindowConfig {
    fn default() -> Self {
        Self {
            seed: 60,
            length: 240,
        }
    }
}

impl Default for LossConfig {
    fn default() -> Self {
        Self {
            lambda: 5.0,
            sigma: 0.05,
            root_weight: 1.0,
            velocity_weight: 0.0,
        }
    }
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            steps: 300_000,
            batch_size: 20,
            shards: Shards::default(),
            key_poses: 6,
            key_pose_distance: 10,
        }
    }
}

/// Least windows in a shard: fewer are no slower, but each shard has a gradient of its own.
const WORTHWHILE: usize = 5;

impl ScheduleConfig {
    /// Shards of a step.
    pub fn shards(&self) -> usize {
        self.shards.count(self.batch_size, WORTHWHILE)
    }
}

impl WindowConfig {
    /// T - T', frames that are generated at once.
    pub fn generated(&self) -> usize {
        self.length - self.seed
    }
}

impl Pu2022Settings {
    /// # Errors
    /// The first value out of its range.
    pub(super) fn check_values(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        let model = &self.model;
        within("model.heads", model.heads, 1, 1024)?;
        within("model.width", model.width, 4, 65_536)?;
        within("model.motion_layers", model.motion_layers, 0, 64)?;
        within("model.music_layers", model.music_layers, 0, 64)?;
        within("model.cross_layers", model.cross_layers, 1, 64)?;
        within("model.feed_forward", model.feed_forward, 1, 65_536)?;
        let multiple = model.width.is_multiple_of(model.heads) && model.width.is_multiple_of(4);
        let expected = format!("a multiple of 4 and of model.heads = {}", model.heads);
        ValueError::unless(multiple, "model.width", model.width, expected)?;
        let share = (0.0..1.0).contains(&model.dropout);
        ValueError::unless(share, "model.dropout", model.dropout, "0 to below 1")?;
        let window = &self.window;
        within("window.seed", window.seed, 1, 10_000)?;
        within("window.length", window.length, window.seed + 2, 20_000)?;
        let LossConfig {
            lambda,
            sigma,
            root_weight,
            velocity_weight,
        } = self.loss;
        for (key, value) in [
            ("loss.lambda", lambda),
            ("loss.root_weight", root_weight),
            ("loss.velocity_weight", velocity_weight),
        ] {
            let usable = value.is_finite() && value >= 0.0;
            ValueError::unless(usable, key, value, "0 or more")?;
        }
        let usable = sigma.is_finite() && sigma > 0.0;
        ValueError::unless(usable, "loss.sigma", sigma, "more than 0")?;
        let schedule = &self.schedule;
        ValueError::unless(schedule.steps > 0, "schedule.steps", 0, "at least 1")?;
        within("schedule.batch_size", schedule.batch_size, 1, 65_536)?;
        schedule.shards.check(65_536)?;
        let distance = schedule.key_pose_distance;
        within("schedule.key_pose_distance", distance, 1, 10_000)?;
        let most = (window.generated() - 1) / distance + 1;
        within("schedule.key_poses", schedule.key_poses, 0, most)
    }

    /// The same structure in small sizes, for checks in f64.
    pub(super) fn small(&self) -> Self {
        let model = Pu2022Config {
            width: 8,
            heads: 2,
            motion_layers: self.model.motion_layers.min(1),
            music_layers: self.model.music_layers.min(1),
            cross_layers: 2,
            feed_forward: 12,
            ..self.model.clone()
        };
        let window = WindowConfig {
            seed: 4,
            length: 16,
        };
        let mut schedule = self.schedule.clone();
        schedule.key_pose_distance = schedule.key_pose_distance.min(4);
        schedule.key_poses = schedule.key_poses.min(3);
        Self {
            model,
            window,
            schedule,
            ..self.clone()
        }
    }
}

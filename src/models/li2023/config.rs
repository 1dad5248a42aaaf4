//! The tables of a config that are this model's. The defaults are row 6 of table 2, "Ours", with
//! what the specification decides where the paper is silent.

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::Li2023;
use crate::autograd::Real;
use crate::data::DataConfig;
use crate::models::AugmentationConfig;
use crate::models::ModelError;
use crate::models::rotations::{
    Body, RotationNetwork, RotationSettings, ScheduleConfig, WindowStatistics,
};
use crate::models::settings::ValueError;
use crate::models::transition::RootFrame;
use crate::motion::ContactRule;
use crate::nn::Initialiser;

/// All tables.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Li2023Settings {
    pub model: Li2023Config,
    pub loss: LossConfig,
    pub rtr: RootConfig,
    pub contact: ContactConfig,
    pub schedule: ScheduleConfig,
    pub augmentation: AugmentationConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Li2023Config {
    /// "li2023".
    pub kind: String,
    /// c, numbers of a joint's token; a frame's token has d = J c.
    pub width: usize,
    /// L, blocks of each Transformer.
    pub layers: usize,
    /// H, of each Transformer.
    pub heads: usize,
    /// How the input goes between the keyframes: rows 1 and 2 of table 2.
    pub input: Input,
    /// S_k W_kf of the mix embedding E_m.
    pub keyframe_embedding: bool,
    /// S_c W_fc of the mix embedding E_m.
    pub contact_embedding: bool,
    pub state_decoder: StateDecoder,
    /// The state decoder begins at 0, so that training begins at the interpolation.
    pub zero_decoder: bool,
    /// X_res is multiplied by min(1, d / `fade_frames`), d frames from the nearer keyframe; 0: by
    /// 1, as in the paper.
    pub fade_frames: usize,
    /// Probability that a branch of the last block is dropped in training; it grows from 0 in the
    /// first block.
    pub stochastic_depth: f64,
    /// "world", or "keyframe_facing": every window turned so that its first keyframe faces +Z.
    pub root_frame: RootFrame,
}

/// How the network's input goes between the keyframes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Input {
    Linear,
    Slerp,
}

/// From features to X_res (eq. 14).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StateDecoder {
    Linear,
    /// A convolution over three frames, as in the authors' program.
    Conv3,
}

/// `[loss]`: weights of eq. 21; 0 leaves a term out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossConfig {
    /// Of L_con.
    pub contact: f64,
    /// lambda of L_p.
    pub position: f64,
    /// lambda of L_r.
    pub root: f64,
    /// What L_p and L_r are measured in.
    pub unit: LossUnit,
    /// What of the differences of a frame L_rec is a mean of.
    pub reconstruction: Reconstruction,
}

/// What of the differences of a frame L_rec is a mean of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reconstruction {
    /// Their mean square, as the paper's text and the authors' program have it.
    MeanSquare,
    /// Their norm, as eq. 17 is printed; it is what L2Q measures.
    Norm,
}

/// What L_p and L_r are measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossUnit {
    /// cm^2.
    Cm,
    /// Squares of shares of the range that the training windows have.
    Range,
}

/// `[rtr]`: root trajectory reconstruction.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RootConfig {
    /// The weights of the feet in training.
    pub weights: RootWeights,
    /// What becomes of the distance by which the root misses the next keyframe.
    pub meet_target: TargetMeeting,
}

/// The weights of the feet in training.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RootWeights {
    /// The softmax of the contact decoder.
    PredictedSoft,
    /// The labels, as the authors' program trains.
    Given,
}

/// What becomes of the distance by which the root misses the next keyframe.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TargetMeeting {
    /// Nothing, as in the paper.
    No,
    /// It is spread evenly over the frames: every foot slides as much.
    Linear,
}

/// `[contact]`
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ContactConfig {
    /// How recorded frames are labelled.
    pub rule: ContactRule,
}

impl Default for Li2023Config {
    fn default() -> Self {
        Self {
            kind: Li2023Settings::KIND.into(),
            width: 32,
            layers: 4,
            heads: 8,
            input: Input::Slerp,
            keyframe_embedding: true,
            contact_embedding: true,
            state_decoder: StateDecoder::Linear,
            zero_decoder: false,
            fade_frames: 0,
            stochastic_depth: 0.2,
            root_frame: RootFrame::World,
        }
    }
}

impl Default for LossConfig {
    fn default() -> Self {
        Self {
            contact: 1.0,
            position: 1e-5,
            root: 1e-5,
            unit: LossUnit::Cm,
            reconstruction: Reconstruction::MeanSquare,
        }
    }
}

impl Default for RootConfig {
    fn default() -> Self {
        Self {
            weights: RootWeights::PredictedSoft,
            meet_target: TargetMeeting::No,
        }
    }
}

impl Li2023Settings {
    /// Whether the contact decoder learns; else the given labels are used everywhere.
    pub fn predicts_contacts(&self) -> bool {
        self.loss.contact > 0.0
    }
}

impl RotationSettings for Li2023Settings {
    const KIND: &'static str = "li2023";
    const AFTER_THE_NETWORK: &'static [&'static str] = &["rtr.meet_target"];

    fn schedule(&self) -> &ScheduleConfig {
        &self.schedule
    }

    fn augmentation(&self) -> &AugmentationConfig {
        &self.augmentation
    }

    fn root_frame(&self) -> RootFrame {
        self.model.root_frame
    }

    fn contact_rule(&self) -> ContactRule {
        self.contact.rule
    }

    fn check_own(&self, _data: &DataConfig) -> Result<(), ValueError> {
        let Li2023Config {
            width,
            layers,
            heads,
            fade_frames,
            stochastic_depth,
            root_frame,
            ..
        } = self.model;
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            let key = format!("model.{key}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        within("layers", layers, 1, 64)?;
        within("heads", heads, 1, 1024)?;
        within("width", width, 1, 4096)?;
        within("fade_frames", fade_frames, 0, 10_000)?;
        let multiple = width.is_multiple_of(heads);
        let expected = format!("a multiple of model.heads = {heads}");
        ValueError::unless(multiple, "model.width", width, expected)?;
        let (share, expected) = ((0.0..1.0).contains(&stochastic_depth), "0 to below 1");
        ValueError::unless(share, "model.stochastic_depth", stochastic_depth, expected)?;
        let known = root_frame != RootFrame::Keyframe;
        let expected = "world or keyframe_facing: no place is among the network's numbers";
        ValueError::unless(known, "model.root_frame", "keyframe", expected)?;
        let weights = [
            ("loss.contact", self.loss.contact),
            ("loss.position", self.loss.position),
            ("loss.root", self.loss.root),
        ];
        for (key, weight) in weights {
            let finite = weight >= 0.0 && weight.is_finite();
            ValueError::unless(finite, key, weight, "a number, 0 or more")?;
        }
        Ok(())
    }

    fn network<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Box<dyn RotationNetwork<T>>, ModelError> {
        Ok(Box::new(Li2023::new(init, self, body, statistics)?))
    }

    fn small(&self) -> Self {
        let model = Li2023Config {
            width: 4,
            layers: 2,
            heads: 2,
            ..self.model.clone()
        };
        Self {
            model,
            ..self.clone()
        }
    }
}

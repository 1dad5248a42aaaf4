//! Sizes of the network and its ablations.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::models::settings::ValueError;
use crate::models::transition::RootFrame;
use crate::motion::Mapping;
use crate::nn::TransformerSizes;

/// How a controller codes its segments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Controllers {
    /// Encoders over the target segment, decoders over the mixture segment (figure 3).
    Transformer,
    /// Two fully connected layers over both segments ("Condition-FC").
    FullyConnected,
}

/// What the decoders' numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// The frame itself, as in the paper.
    Absolute,
    /// What is added to the prior mean, which follows the keyframes and the given trajectory.
    /// An untrained network gives just these.
    Residual,
}

/// Weights of the terms of eq. 3, and m of eq. 10.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossWeights {
    pub rec: f64,
    pub con: f64,
    /// Of L_contact inside L_con (eq. 5); 0 for a training without it (section 5).
    pub contact: f64,
    pub root: f64,
    /// 0 for "Without L_key".
    pub key: f64,
    pub vfac: f64,
    /// Of single frames, with a control path; not in the paper.
    pub single_frames: f64,
    /// m of eq. 10: frames that a keyframe affects.
    pub key_frames: usize,
}

impl Default for LossWeights {
    fn default() -> Self {
        Self {
            rec: 0.3,
            con: 0.2,
            contact: 1.0,
            root: 0.15,
            key: 0.2,
            vfac: 0.15,
            single_frames: 10.0,
            key_frames: 5,
        }
    }
}

/// The network of section 3.2 with the sizes of section 3.4; an ablation is one field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Pan2021Config {
    /// 2, or 1 for "One LSTM".
    pub lstms: usize,
    /// [`Controllers::FullyConnected`] for "Condition-FC".
    pub controllers: Controllers,
    /// 2, or 1 for "One decoder".
    pub decoders: usize,
    /// false for "Without Velfac constraint": no velocity factor controller and no L_vfac.
    pub velocity_factor: bool,
    /// Frame of reference of p^r, o^r and v^r; the paper's is the world's.
    pub root_frame: RootFrame,
    /// What the decoders give; the paper's give the frame itself.
    pub output: Output,
    /// A feed-forward path from the controls around each frame to what is added to its prior mean;
    /// not in the paper.
    pub control_path: bool,
    /// Control paths whose mean is taken: an ensemble.
    pub control_path_members: usize,
    /// Both hidden layers of a control path.
    pub control_path_hidden: usize,
    /// Frames by themselves that a control path is trained on in each step, beside the batch's
    /// windows.
    pub single_frames: usize,
    /// Predicted bodies are brought to the velocity factors that were asked for; not in the paper,
    /// see [`crate::models::transition::velocity_refinement`].
    pub velocity_refinement: bool,
    /// For clips on another skeleton than the dance skeleton: how the model sees them. A config
    /// file gives the file's path; positions of joints that both have are what it answers.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mapping: Option<Mapping>,
    /// First hidden layer of encoders and decoders.
    pub hidden: usize,
    /// Codes, LSTM states, Transformer tokens, second hidden layer of the decoders.
    pub code: usize,
    /// u, frames in a controller's window (odd).
    pub window: usize,
    pub heads: usize,
    pub encoder_layers: usize,
    pub decoder_layers: usize,
    pub feed_forward: usize,
    /// After attention weights and sublayers of the Transformers.
    pub dropout: f64,
    pub loss: LossWeights,
}

impl Default for Pan2021Config {
    fn default() -> Self {
        Self {
            lstms: 2,
            controllers: Controllers::Transformer,
            decoders: 2,
            velocity_factor: true,
            root_frame: RootFrame::World,
            output: Output::Absolute,
            control_path: false,
            control_path_members: 1,
            control_path_hidden: 512,
            single_frames: 512,
            velocity_refinement: false,
            mapping: None,
            hidden: 512,
            code: 256,
            window: 7,
            heads: 8,
            encoder_layers: 2,
            decoder_layers: 2,
            feed_forward: 256,
            dropout: 0.1,
            loss: LossWeights::default(),
        }
    }
}

impl Pan2021Config {
    /// The same structure in small sizes (8 numbers a code, 2 heads), for checks in f64.
    pub fn small(&self) -> Self {
        Self {
            control_path_hidden: 8,
            hidden: 8,
            code: 8,
            heads: 2,
            feed_forward: 8,
            ..self.clone()
        }
    }

    pub(super) fn transformer(&self) -> TransformerSizes {
        TransformerSizes {
            width: self.code,
            heads: self.heads,
            feed_forward: self.feed_forward,
            dropout: self.dropout,
        }
    }

    /// Checks the fields by themselves and against each other.
    ///
    /// # Errors
    /// The first out of its range.
    pub fn check(&self) -> Result<(), ValueError> {
        let require = |valid: bool, key: &str, value: &dyn fmt::Display, expected: &str| {
            ValueError::unless(valid, format!("model.{key}"), value, expected)
        };
        for (key, value) in [("lstms", self.lstms), ("decoders", self.decoders)] {
            require((1..=2).contains(&value), key, &value, "1 or 2")?;
        }
        for (key, value, least, most) in [
            ("control_path_members", self.control_path_members, 1, 64),
            ("control_path_hidden", self.control_path_hidden, 1, 65_536),
            ("hidden", self.hidden, 1, 65_536),
            ("code", self.code, 1, 4096),
            ("heads", self.heads, 1, 256),
            ("encoder_layers", self.encoder_layers, 1, 64),
            ("decoder_layers", self.decoder_layers, 1, 64),
            ("feed_forward", self.feed_forward, 1, 65_536),
            ("loss.key_frames", self.loss.key_frames, 1, 65_536),
            ("single_frames", self.single_frames, 0, 65_536),
        ] {
            let expected = format!("{least} to {most}");
            require((least..=most).contains(&value), key, &value, &expected)?;
        }
        let mapping = self.mapping.as_ref();
        require(
            mapping.is_none_or(Mapping::keeps_units),
            "mapping",
            &"a file that declares a unit or an axis",
            "one that names joints alone; declare the clips' in [data]",
        )?;
        require(
            self.code.is_multiple_of(self.heads),
            "code",
            &self.code,
            &format!("a multiple of model.heads = {}", self.heads),
        )?;
        require(
            !self.control_path || self.output == Output::Residual,
            "control_path",
            &self.control_path,
            "model.output = \"residual\" with it: it corrects a prior mean",
        )?;
        require(
            !self.velocity_refinement || self.velocity_factor,
            "velocity_refinement",
            &self.velocity_refinement,
            "model.velocity_factor = true with it: it asks for velocity factors",
        )?;
        require(
            !self.window.is_multiple_of(2) && self.window <= 1001,
            "window",
            &self.window,
            "an odd number up to 1001",
        )?;
        require(
            (0.0..1.0).contains(&self.dropout),
            "dropout",
            &self.dropout,
            "at least 0 and below 1",
        )?;
        let loss = self.loss;
        for (key, value) in [
            ("loss.rec", loss.rec),
            ("loss.con", loss.con),
            ("loss.contact", loss.contact),
            ("loss.root", loss.root),
            ("loss.key", loss.key),
            ("loss.vfac", loss.vfac),
            ("loss.single_frames", loss.single_frames),
        ] {
            require(value.is_finite() && value >= 0.0, key, &value, "0 or more")?;
        }
        Ok(())
    }
}

//! Sizes of the network and its ablations.

use serde::{Deserialize, Serialize};

use crate::models::ModelError;
use crate::models::transition::RootFrame;
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
    /// What is added to the best linear estimate from the keyframes, and to the given trajectory. An untrained
    /// network gives just these.
    Residual,
}

/// Weights of the terms of eq. 3, and m of eq. 10.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LossWeights {
    pub rec: f64,
    pub con: f64,
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
    /// A feed-forward path from the controls around each frame to what is added to its estimate; not in the paper.
    pub control_path: bool,
    /// Control paths whose mean is taken: an ensemble.
    pub control_path_members: usize,
    /// Both hidden layers of a control path.
    pub control_path_hidden: usize,
    /// Frames by themselves that a control path is trained on in each step, beside the batch's windows.
    pub single_frames: usize,
    /// Predicted bodies are brought to the velocity factors that were asked for; not in the paper, see
    /// [`crate::models::transition::velocity_refinement`].
    pub velocity_refinement: bool,
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

    /// Checks the fields against each other.
    ///
    /// # Errors
    /// [`ModelError::Model`] that names the field and what it must be.
    pub fn check(&self) -> Result<(), ModelError> {
        let complain = |reason: String| {
            Err(ModelError::Model {
                model: "pan2021".into(),
                reason,
            })
        };
        for (key, value) in [("lstms", self.lstms), ("decoders", self.decoders)] {
            if !(1..=2).contains(&value) {
                return complain(format!("model.{key} = {value}: expected 1 or 2"));
            }
        }
        for (key, value, most) in [
            ("control_path_members", self.control_path_members, 64),
            ("control_path_hidden", self.control_path_hidden, 65_536),
            ("hidden", self.hidden, 65_536),
            ("code", self.code, 4096),
            ("heads", self.heads, 256),
            ("encoder_layers", self.encoder_layers, 64),
            ("decoder_layers", self.decoder_layers, 64),
            ("feed_forward", self.feed_forward, 65_536),
            ("loss.key_frames", self.loss.key_frames, 65_536),
        ] {
            if !(1..=most).contains(&value) {
                return complain(format!("model.{key} = {value}: expected 1 to {most}"));
            }
        }
        if self.single_frames > 65_536 {
            return complain(format!(
                "model.single_frames = {}: expected 0 to 65536",
                self.single_frames
            ));
        }
        if !self.code.is_multiple_of(self.heads) {
            return complain(format!(
                "model.code = {}: expected a multiple of model.heads = {}",
                self.code, self.heads
            ));
        }
        if self.control_path && self.output == Output::Absolute {
            return complain(
                "model.control_path = true corrects an estimate: expected model.output = \"residual\""
                    .into(),
            );
        }
        if self.velocity_refinement && !self.velocity_factor {
            return complain(
                "model.velocity_refinement = true asks for velocity factors: expected model.velocity_factor = true".into(),
            );
        }
        if self.window.is_multiple_of(2) || self.window > 1001 {
            return complain(format!(
                "model.window = {}: expected an odd number up to 1001",
                self.window
            ));
        }
        if !(0.0..1.0).contains(&self.dropout) {
            return complain(format!(
                "model.dropout = {}: expected at least 0 and below 1",
                self.dropout
            ));
        }
        let LossWeights {
            rec,
            con,
            root,
            key,
            vfac,
            single_frames,
            ..
        } = self.loss;
        for (name, value) in [
            ("rec", rec),
            ("con", con),
            ("root", root),
            ("key", key),
            ("vfac", vfac),
            ("single_frames", single_frames),
        ] {
            if !(value.is_finite() && value >= 0.0) {
                return complain(format!("model.loss.{name} = {value}: expected 0 or more"));
            }
        }
        Ok(())
    }
}

//! Spatial and temporal encoders, mix embedding, state and contact decoders (section 3.5).

use rand::Rng;

use super::config::Input;
use super::{Li2023Config, Li2023Settings, StateDecoder, TargetMeeting, losses};
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};
use crate::models::rotations::{
    Batch, Body, Prediction, RootSource, RotationNetwork, WindowStatistics,
};
use crate::models::{LossTerms, ModelError};
use crate::motion::Feet;
use crate::motion::rotation_window::Interpolation;
use crate::nn::{
    Convolution, Initialiser, LayerNorm, Linear, PreNormEncoderLayer, TransformerSizes,
};

/// The network. Rows are frames, the T frames of a window together; J joints, d = J c.
#[derive(Debug, Clone)]
pub struct Li2023 {
    pub(super) settings: Li2023Settings,
    pub(super) parents: Vec<Option<usize>>,
    /// The joints that stand still while a foot is in contact, right and left.
    pub(super) feet: [usize; 2],
    /// What L_p and L_r are divided by before they are squared, cm.
    pub(super) loss_units: [f64; 2],
    /// W_s and its bias, 4 -> c.
    embed: Linear,
    spatial: Encoder,
    mix_keyframe: Option<Linear>,
    mix_contact: Option<Linear>,
    temporal: Encoder,
    state: State,
    contact: Linear,
}

/// A Transformer with a learned position and a norm at its end.
#[derive(Debug, Clone)]
struct Encoder {
    /// E_s `[J, c]` or E_t `[T, d]`.
    position: BlockId,
    layers: Vec<PreNormEncoderLayer>,
    norm: LayerNorm,
}

#[derive(Debug, Clone)]
enum State {
    Linear(Linear),
    Convolution(Convolution),
}

/// What the network says, a row a frame.
#[derive(Debug, Clone, Copy)]
pub struct Output {
    /// Y, `[rows, 4 J]`.
    pub rotations: Var,
    /// What S_c is the softmax of, `[rows, 2]`.
    pub contact_logits: Var,
}

impl Encoder {
    fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        config: &Li2023Config,
        positions: usize,
        width: usize,
    ) -> Result<Self, AutogradError> {
        let sizes = TransformerSizes {
            width,
            heads: config.heads,
            feed_forward: 2 * width,
            dropout: 0.0,
        };
        let (_, position) = init.constant(format!("{name}.position"), &[positions, width], 0.0);
        let steps = (config.layers - 1).max(1) as f64;
        let layers = (0..config.layers).map(|l| {
            let drop_path = config.stochastic_depth * l as f64 / steps;
            PreNormEncoderLayer::new(init, &format!("{name}.layers.{l}"), sizes, drop_path)
        });
        Ok(Self {
            position,
            layers: layers.collect::<Result<_, _>>()?,
            norm: LayerNorm::new(init, &format!("{name}.norm"), width),
        })
    }

    /// Tokens `[n tokens, width]`, of each sequence the first of as many positions, to features.
    fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let shape = tape.shape(x).to_vec();
        let position = tape.block(self.position);
        let position = tape.rows(position, 0..tokens)?;
        let position = tape.reshape(position, &[1, tokens * shape[1]])?;
        let sequences = tape.reshape(x, &[shape[0] / tokens, tokens * shape[1]])?;
        let placed = tape.add(sequences, position)?;
        let mut x = tape.reshape(placed, &shape)?;
        for layer in &self.layers {
            x = layer.forward(tape, x, tokens)?;
        }
        self.norm.forward(tape, x)
    }
}

impl Li2023 {
    /// Adds `spatial.embed`, `spatial.position`, `spatial.layers.{l}`, `spatial.norm`,
    /// `mix.keyframe`, `mix.contact`, `temporal.position`, `temporal.layers.{l}`, `temporal.norm`,
    /// `state`, `contact`.
    ///
    /// # Errors
    /// Heads that do not divide the width; a body without feet.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        settings: &Li2023Settings,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Self, ModelError> {
        let built = |error: AutogradError| ModelError::data(&error);
        let config = &settings.model;
        let (joints, c) = (body.joints(), config.width);
        let d = joints * c;
        let feet = Feet::of(body.skeleton()).map_err(|error| ModelError::data(&error))?;
        let embed = Linear::new(init, "spatial.embed", 4, c);
        let spatial = Encoder::new(init, "spatial", config, joints, c).map_err(built)?;
        let mut mix = |name: &str, there: bool| there.then(|| Linear::new(init, name, 2, d));
        let mix_keyframe = mix("mix.keyframe", config.keyframe_embedding);
        let mix_contact = mix("mix.contact", config.contact_embedding);
        let longest = settings.schedule.lengths.max;
        let temporal = Encoder::new(init, "temporal", config, longest, d).map_err(built)?;
        let state = match config.state_decoder {
            StateDecoder::Linear if config.zero_decoder => {
                State::Linear(Linear::of_zeros(init, "state", d, 4 * joints))
            }
            StateDecoder::Linear => State::Linear(Linear::new(init, "state", d, 4 * joints)),
            StateDecoder::Conv3 => {
                let make = match config.zero_decoder {
                    true => Convolution::of_zeros,
                    false => Convolution::new,
                };
                let layer = make(init, "state", (d, 4 * joints), 3);
                State::Convolution(layer.map_err(built)?)
            }
        };
        Ok(Self {
            settings: settings.clone(),
            parents: body.parents(),
            feet: settings.contact.rule.joints(&feet),
            loss_units: match settings.loss.unit {
                super::LossUnit::Cm => [1.0; 2],
                super::LossUnit::Range => statistics.ranges,
            },
            embed,
            spatial,
            mix_keyframe,
            mix_contact,
            temporal,
            state,
            contact: Linear::new(init, "contact", d, 2),
        })
    }

    /// Eq. 12 to 16.
    ///
    /// # Errors
    /// A batch of another body, or of longer windows than `schedule.lengths.max`.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Output, AutogradError> {
        let (rows, joints) = (batch.rows(), self.parents.len());
        let d = joints * self.settings.model.width;
        let input = tape.constant(batch.input.clone());
        let tokens = tape.reshape(input, &[rows * joints, 4])?;
        let x = self.embed.forward(tape, tokens)?;
        let x = self.spatial.forward(tape, x, joints)?;
        let mut x = tape.reshape(x, &[rows, d])?;
        for (layer, code) in [
            (&self.mix_keyframe, &batch.keyframes),
            (&self.mix_contact, &batch.contacts),
        ] {
            if let Some(layer) = layer {
                let code = tape.constant(code.clone());
                let embedding = layer.forward(tape, code)?;
                x = tape.add(x, embedding)?;
            }
        }
        let x = self.temporal.forward(tape, x, batch.frames)?;
        let mut residual = match &self.state {
            State::Linear(layer) => layer.forward(tape, x)?,
            State::Convolution(layer) => layer.forward(tape, x, batch.frames)?,
        };
        let fade = self.settings.model.fade_frames;
        if fade > 0 {
            let share = |d: T| T::from_f64((d.to_f64() / fade as f64).min(1.0));
            let shares = tape.constant(batch.distances.mapv(share));
            residual = tape.mul(residual, shares)?;
        }
        Ok(Output {
            rotations: tape.add(input, residual)?,
            contact_logits: self.contact.forward(tape, x)?,
        })
    }
}

impl<T: Real> RotationNetwork<T> for Li2023 {
    fn input(&self) -> Interpolation {
        match self.settings.model.input {
            Input::Linear => Interpolation::Linear,
            Input::Slerp => Interpolation::Slerp,
        }
    }

    fn losses(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>) -> Result<LossTerms, AutogradError> {
        let output = self.forward(tape, batch)?;
        losses(self, tape, output, batch)
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Prediction, AutogradError> {
        let output = self.forward(tape, batch)?;
        Ok(Prediction {
            rotations: output.rotations,
            contacts: Some(tape.softmax(output.contact_logits)),
            root: None,
        })
    }

    fn root(&self) -> RootSource {
        RootSource::Reconstructed {
            rule: self.settings.contact.rule,
            given: !self.settings.predicts_contacts(),
            meets_target: self.settings.rtr.meet_target == TargetMeeting::Linear,
        }
    }

    fn needs_contacts(&self) -> bool {
        self.settings.model.contact_embedding || !self.settings.predicts_contacts()
    }

    fn longest(&self) -> usize {
        self.settings.schedule.lengths.max
    }
}

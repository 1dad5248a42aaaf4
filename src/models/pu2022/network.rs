//! The network: encoders of motion and music, the cross-modal Transformer, and what is added to its
//! tokens.

use ndarray::Array2;
use rand::Rng;

use super::batch::Batch;
use super::config::{LossConfig, MusicSpan, Norm, Pu2022Config, Pu2022Settings};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::nn::{
    Initialiser, LayerNorm, Linear, MultiHeadAttention, TransformerEncoderLayer, TransformerSizes,
};

/// The network of Pu and Shan 2022.
#[derive(Debug, Clone)]
pub struct Pu2022 {
    config: Pu2022Config,
    loss: LossConfig,
    motion_linear: Linear,
    music_linear: Linear,
    key_linear: Linear,
    motion_encoder: Encoder,
    music_encoder: Encoder,
    cross: Encoder,
    output: Linear,
}

/// Layers of a stack, as `torch.nn.TransformerEncoder`.
#[derive(Debug, Clone)]
struct Encoder {
    layers: Vec<EncoderLayer>,
    /// Of layers that normalise before their branches.
    norm: Option<LayerNorm>,
}

#[derive(Debug, Clone)]
enum EncoderLayer {
    Post(TransformerEncoderLayer),
    Pre(PreNormLayer),
}

/// A layer that normalises before each branch, as `torch.nn.TransformerEncoderLayer` with
/// `norm_first=True`.
#[derive(Debug, Clone)]
struct PreNormLayer {
    self_attention: MultiHeadAttention,
    linear1: Linear,
    linear2: Linear,
    norms: [LayerNorm; 2],
    dropout: f64,
}

impl PreNormLayer {
    fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Result<Self, AutogradError> {
        let (d, wide) = (sizes.width, sizes.feed_forward);
        Ok(Self {
            self_attention: MultiHeadAttention::new(init, &format!("{name}.self_attn"), sizes)?,
            linear1: Linear::new(init, &format!("{name}.linear1"), d, wide),
            linear2: Linear::new(init, &format!("{name}.linear2"), wide, d),
            norms: [1, 2].map(|k| LayerNorm::new(init, &format!("{name}.norm{k}"), d)),
            dropout: sizes.dropout,
        })
    }

    fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let y = self.norms[0].forward(tape, x)?;
        let y = self.self_attention.own(tape, y, tokens)?;
        let y = tape.dropout(y, self.dropout);
        let x = tape.add(x, y)?;
        let y = self.norms[1].forward(tape, x)?;
        let y = self.linear1.forward_relu(tape, y)?;
        let y = tape.dropout(y, self.dropout);
        let y = self.linear2.forward(tape, y)?;
        let y = tape.dropout(y, self.dropout);
        tape.add(x, y)
    }
}

impl Encoder {
    /// Adds `{name}.layers.{l}` and, where layers normalise before their branches, `{name}.norm`.
    fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        config: &Pu2022Config,
        layers: usize,
    ) -> Result<Self, AutogradError> {
        let sizes = TransformerSizes {
            width: config.width,
            heads: config.heads,
            feed_forward: config.feed_forward,
            dropout: config.dropout,
        };
        let mut layer = |l: usize| {
            let name = format!("{name}.layers.{l}");
            Ok(match config.norm {
                Norm::Post => {
                    let layer = TransformerEncoderLayer::new(init, &name, sizes)?;
                    EncoderLayer::Post(layer.with_inner_dropout())
                }
                Norm::Pre => EncoderLayer::Pre(PreNormLayer::new(init, &name, sizes)?),
            })
        };
        let layers = (0..layers)
            .map(&mut layer)
            .collect::<Result<_, AutogradError>>()?;
        let norm = match config.norm {
            Norm::Post => None,
            Norm::Pre => Some(LayerNorm::new(init, &format!("{name}.norm"), config.width)),
        };
        Ok(Self { layers, norm })
    }

    /// Tokens `[windows * tokens, d]` to the same shape.
    fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let mut x = x;
        for layer in &self.layers {
            x = match layer {
                EncoderLayer::Post(layer) => layer.forward(tape, x, tokens)?,
                EncoderLayer::Pre(layer) => layer.forward(tape, x, tokens)?,
            };
        }
        match &self.norm {
            Some(norm) => norm.forward(tape, x),
            None => Ok(x),
        }
    }
}

impl Pu2022 {
    /// Adds `motion_linear`, `music_linear`, `key_linear`, `motion_encoder`, `music_encoder`,
    /// `cross`, `output`. `joints`: J; `music`: numbers of a frame of music.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        settings: &Pu2022Settings,
        joints: usize,
        music: usize,
    ) -> Result<Self, AutogradError> {
        let config = &settings.model;
        let (numbers, d) = (6 * joints + 3, config.width);
        Ok(Self {
            motion_linear: Linear::new(init, "motion_linear", numbers, d),
            music_linear: Linear::new(init, "music_linear", music, d),
            key_linear: Linear::new(init, "key_linear", 6 * joints, d),
            motion_encoder: Encoder::new(init, "motion_encoder", config, config.motion_layers)?,
            music_encoder: Encoder::new(init, "music_encoder", config, config.music_layers)?,
            cross: Encoder::new(init, "cross", config, config.cross_layers)?,
            output: Linear::new(init, "output", d, numbers),
            config: config.clone(),
            loss: settings.loss.clone(),
        })
    }

    /// y'_T'+1 to y'_T of every window, `[W (T - T'), 6 J + 3]`.
    ///
    /// # Errors
    /// A batch of another body, or with other music.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Var, AutogradError> {
        let d = self.config.width;
        let (windows, seed, length) = (batch.windows, batch.window.seed, batch.window.length);
        let motion = tape.constant(batch.seed.clone());
        let motion = self.motion_linear.forward(tape, motion)?;
        let positions = tape.constant(batch.positions(seed, d));
        let motion = tape.add(motion, positions)?;
        let motion = self.motion_encoder.forward(tape, motion, seed)?;
        let music = match self.config.music {
            true => tape.constant(batch.music.clone()),
            false => {
                let shape = batch.music.shape().to_vec();
                tape.constant_with(&shape, |out| out.fill(T::zero()))
            }
        };
        let music = self.music_linear.forward(tape, music)?;
        let positions = tape.constant(batch.positions(length, d));
        let music = tape.add(music, positions)?;
        let music = self.music_encoder.forward(tape, music, length)?;

        let terms = self.terms(tape, batch)?;
        let motion = tape.reshape(motion, &[windows, seed * d])?;
        let music = tape.reshape(music, &[windows, length * d])?;
        let (joined, tokens) = match self.config.music_span {
            MusicSpan::Future => {
                let future = tape.columns(music, seed * d..length * d)?;
                let joined = tape.concat(&[motion, future])?;
                let joined = match terms {
                    Some(terms) => tape.add(joined, terms)?,
                    None => joined,
                };
                (joined, length)
            }
            MusicSpan::Whole => {
                let music = match terms {
                    Some(terms) => tape.add(music, terms)?,
                    None => music,
                };
                let motion = match self.config.ordinary_positions {
                    true => {
                        let positions = tape.constant(batch.positions(seed, d));
                        let positions = tape.reshape(positions, &[windows, seed * d])?;
                        tape.add(motion, positions)?
                    }
                    false => motion,
                };
                (tape.concat(&[motion, music])?, seed + length)
            }
        };
        let joined = tape.reshape(joined, &[windows * tokens, d])?;
        let crossed = self.cross.forward(tape, joined, tokens)?;
        let crossed = tape.reshape(crossed, &[windows, tokens * d])?;
        let generated = length - seed;
        let generated_columns = (tokens - generated) * d..tokens * d;
        let crossed = tape.columns(crossed, generated_columns)?;
        let crossed = tape.reshape(crossed, &[windows * generated, d])?;
        self.output.forward(tape, crossed)
    }

    /// e_t + l_t + P (eq. 11), those that the config has, `[W, T d]`.
    fn terms<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Option<Var>, AutogradError> {
        let (d, length) = (self.config.width, batch.window.length);
        let mut terms = Vec::new();
        if self.config.key_pose_embedding {
            let poses = tape.constant(batch.key_poses.clone());
            let embedded = self.key_linear.forward(tape, poses)?;
            let is_key = tape.constant(batch.is_key.clone());
            // After the projection, so that its bias does not mark frames without a key pose.
            terms.push(tape.mul(embedded, is_key)?);
        }
        if self.config.local_positions {
            terms.push(tape.constant(batch.local_positions(d)));
        }
        if self.config.ordinary_positions {
            terms.push(tape.constant(batch.positions(length, d)));
        }
        let mut sum: Option<Var> = None;
        for term in terms {
            let term = tape.reshape(term, &[batch.windows, length * d])?;
            sum = Some(match sum {
                Some(sum) => tape.add(sum, term)?,
                None => term,
            });
        }
        Ok(sum)
    }

    /// L (eq. 14): the mean over windows and generated frames of w_t |y_t - y'_t|^2, and the same
    /// without weights; a part of a step's. Where the config weighs them, too: the squares of the
    /// root's place times `loss.root_weight`, and `velocity`, the mean of |(y_t - y_t-1) - (y'_t -
    /// y'_t-1)|^2 with y'_T' = y_T', which the seed gives.
    ///
    /// # Errors
    /// A batch without its truth.
    pub fn losses<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<LossTerms, AutogradError> {
        let truth = batch.truth.as_ref().ok_or(AutogradError::Misplaced {
            operation: "losses",
            what: "the batch has no truth to compare with",
        })?;
        let said = self.forward(tape, batch)?;
        let truth = tape.constant(truth.clone());
        let difference = tape.sub(truth, said)?;
        let squares = tape.square(difference);
        let weights = tape.constant(batch.weights.clone());
        let weighted = tape.mul(squares, weights)?;
        let weighted = self.weigh_root(tape, weighted)?;
        let mut terms = vec![("weighted", 1.0, weighted), ("plain", 0.0, squares)];
        if self.loss.velocity_weight > 0.0 {
            let changes = changes(tape, difference, batch)?;
            let squares = tape.square(changes);
            let squares = self.weigh_root(tape, squares)?;
            terms.push(("velocity", self.loss.velocity_weight, squares));
        }
        let mean = 1.0 / (batch.total_windows * batch.window.generated()) as f64;
        for (_, _, term) in &mut terms {
            let sum = tape.sum(*term);
            *term = tape.affine(sum, mean, 0.0);
        }
        LossTerms::weighted(tape, &terms, None)
    }

    /// Squares `[rows, 6 J + 3]`, those of the root's place weighted.
    fn weigh_root<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        squares: Var,
    ) -> Result<Var, AutogradError> {
        if self.loss.root_weight == 1.0 {
            return Ok(squares);
        }
        let numbers = tape.shape(squares)[1];
        let weight = |number| match number + 3 < numbers {
            true => T::one(),
            false => T::from_f64(self.loss.root_weight),
        };
        let weights = Array2::from_shape_fn((1, numbers), |(_, number)| weight(number));
        let weights = tape.constant(weights);
        tape.mul(squares, weights)
    }
}

/// Changes from each generated frame of a window to the next, the first from 0; values and changes
/// are `[W (T - T'), numbers]`.
fn changes<T: Real>(
    tape: &mut Tape<'_, T>,
    values: Var,
    batch: &Batch<T>,
) -> Result<Var, AutogradError> {
    let shape = tape.shape(values).to_vec();
    let (windows, numbers) = (batch.windows, shape[1]);
    let generated = batch.window.generated();
    let values = tape.reshape(values, &[windows, generated * numbers])?;
    let before = tape.columns(values, 0..(generated - 1) * numbers)?;
    let none = tape.constant_with(&[windows, numbers], |out| out.fill(T::zero()));
    let before = tape.concat(&[none, before])?;
    let changes = tape.sub(values, before)?;
    tape.reshape(changes, &shape)
}

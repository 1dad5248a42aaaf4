//! The root trajectory controller and the velocity factor controller (section 3.2, figure 3).
//!
//! Both read, for the prediction of frame t + 1, two segments of u frames centred on t + 1: the
//! target segment holds the given values, the mixture segment what was fed for the frames up to t.
//! Frames beyond an end of the transition repeat it.
//!
//! A token's embedding is linear in its c numbers plus a constant of its position, so it is one
//! product with the numbers and a one-hot position, `[c + u]`, and the first layer's self-attention
//! is a [`NarrowAttention`] of them. Its weights are made once a tape.

use ndarray::Array2;
use rand::Rng;

use super::config::{Controllers, Pan2021Config};
use super::units::constant;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::nn::{
    Initialiser, LastLayer, Linear, Mlp, MultiHeadAttention, NarrowAttention,
    TransformerDecoderLayer, TransformerEncoderLayer, sinusoidal_positions,
};

/// Windows coded at once where few are asked for: products with few rows are slow.
const WINDOWS_AT_ONCE: usize = 32;

/// A controller's weights.
#[derive(Debug, Clone)]
pub(super) struct Controller {
    /// c: numbers of a frame.
    channels: usize,
    /// u: frames of a segment.
    window: usize,
    kind: Kind,
}

#[derive(Debug, Clone)]
enum Kind {
    Transformer(Box<TransformerController>),
    FullyConnected(Mlp),
}

#[derive(Debug, Clone)]
struct TransformerController {
    target_projection: Linear,
    mixture_projection: Linear,
    encoder: Vec<TransformerEncoderLayer>,
    decoder: Vec<TransformerDecoderLayer>,
    output: Linear,
    positions: Array2<f64>,
}

/// The values that a controller is given for a transition, `[N + 1, windows, c]`.
pub(super) struct Trajectory<T> {
    pub(super) values: Vec<T>,
    pub(super) frames: usize,
    pub(super) windows: usize,
}

/// A controller at work on one tape.
pub(super) struct Session<'c, T> {
    segments: Segments<T>,
    kind: SessionKind<'c>,
}

enum SessionKind<'c> {
    Transformer(Box<Coder<'c>>),
    FullyConnected(&'c Mlp),
}

/// A trajectory cut into segments of u frames.
struct Segments<T> {
    trajectory: Trajectory<T>,
    channels: usize,
    window: usize,
}

/// A Transformer controller at work.
struct Coder<'c> {
    transformer: &'c TransformerController,
    composed: Composed,
    /// Coded target segments of the frames from its first on.
    memory: Option<Memory>,
}

/// Weights made on the tape, see the module's page.
struct Composed {
    one_hot: Vec<Var>,
    target: Embedding,
    mixture: Embedding,
}

#[derive(Clone, Copy)]
struct Embedding {
    /// `[d, c + u]`
    token: Var,
    attention: NarrowAttention,
}

struct Memory {
    first: usize,
    frames: usize,
    /// The encoder's output, `[frames * windows * u, d]`.
    tokens: Var,
    /// Keys and values for each decoder layer but the last, `[frames * windows * u, 2d]`.
    projected: Vec<Var>,
}

impl Controller {
    pub(super) fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        channels: usize,
        config: &Pan2021Config,
    ) -> Result<Self, AutogradError> {
        let (d, window) = (config.code, config.window);
        let kind = match config.controllers {
            Controllers::FullyConnected => Kind::FullyConnected(Mlp::new(
                init,
                name,
                &[2 * window * channels, d, d],
                LastLayer::Activated,
            )),
            Controllers::Transformer => {
                let sizes = config.transformer();
                let projection = |init: &mut Initialiser<'_, T, R>, kind: &str| {
                    Linear::new(init, &format!("{name}.{kind}"), channels, d)
                };
                Kind::Transformer(Box::new(TransformerController {
                    target_projection: projection(init, "target_projection"),
                    mixture_projection: projection(init, "mixture_projection"),
                    encoder: (0..config.encoder_layers)
                        .map(|k| {
                            let name = format!("{name}.encoder.layers.{k}");
                            TransformerEncoderLayer::new(init, &name, sizes)
                        })
                        .collect::<Result<_, _>>()?,
                    decoder: (0..config.decoder_layers)
                        .map(|k| {
                            let name = format!("{name}.decoder.layers.{k}");
                            TransformerDecoderLayer::new(init, &name, sizes)
                        })
                        .collect::<Result<_, _>>()?,
                    output: Linear::new(init, &format!("{name}.output"), d, d),
                    positions: sinusoidal_positions(window, d),
                }))
            }
        };
        Ok(Self {
            channels,
            window,
            kind,
        })
    }

    /// Starts on a transition.
    pub(super) fn start<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        trajectory: Trajectory<T>,
    ) -> Result<Session<'_, T>, AutogradError> {
        let kind = match &self.kind {
            Kind::FullyConnected(mlp) => SessionKind::FullyConnected(mlp),
            Kind::Transformer(transformer) => {
                let composed = transformer.compose_both(tape, trajectory.windows)?;
                SessionKind::Transformer(Box::new(Coder {
                    transformer,
                    composed,
                    memory: None,
                }))
            }
        };
        Ok(Session {
            segments: Segments {
                trajectory,
                channels: self.channels,
                window: self.window,
            },
            kind,
        })
    }
}

impl TransformerController {
    fn compose_both<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        windows: usize,
    ) -> Result<Composed, AutogradError> {
        let u = self.positions.nrows();
        let one_hot = (0..u)
            .map(|position| {
                tape.constant_with(&[windows, u], |out| {
                    out.fill(T::zero());
                    for row in out.chunks_exact_mut(u) {
                        row[position] = T::one();
                    }
                })
            })
            .collect();
        let encoder = &self.encoder[0].self_attention;
        let decoder = &self.decoder[0].self_attention;
        Ok(Composed {
            one_hot,
            target: self.compose(tape, self.target_projection, encoder)?,
            mixture: self.compose(tape, self.mixture_projection, decoder)?,
        })
    }

    /// The weights from (numbers, one-hot position) to tokens, and the first self-attention of
    /// these.
    fn compose<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        embedding: Linear,
        attention: &MultiHeadAttention,
    ) -> Result<Embedding, AutogradError> {
        let (u, d) = self.positions.dim();
        let (weight, bias) = (tape.block(embedding.weight), tape.block(embedding.bias));
        let channels = tape.shape(weight).last().copied().unwrap_or(0);
        let positions = constant(tape, &[d, u], self.positions.t());
        let bias = tape.reshape(bias, &[d, 1])?;
        let positions = tape.add(positions, bias)?;
        let token = tape.concat(&[weight, positions])?;

        let k = channels + u;
        let identity = tape.constant_with(&[k, k], |out| {
            out.fill(T::zero());
            out.iter_mut().step_by(k + 1).for_each(|x| *x = T::one());
        });
        let basis = tape.linear(identity, token, None, false)?;
        Ok(Embedding {
            token,
            attention: attention.narrow(tape, basis, channels..k)?,
        })
    }

    /// Codes target segments `[rows, c + u]`: the encoder's output and the decoders' keys and
    /// values of it.
    fn encode<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        embedding: Embedding,
        segments: Var,
        u: usize,
    ) -> Result<(Var, Vec<Var>), AutogradError> {
        let x = tape.linear(segments, embedding.token, None, false)?;
        let first = &self.encoder[0];
        let attention = &first.self_attention;
        let y = attention.own_narrow(tape, embedding.attention, segments, u)?;
        let mut x = first.forward_attended(tape, x, y)?;
        for layer in &self.encoder[1..] {
            x = layer.forward(tape, x, u)?;
        }
        let (_, before_last) = self.split_decoder();
        let projected = before_last
            .iter()
            .map(|layer| layer.project_memory(tape, x))
            .collect::<Result<_, _>>()?;
        Ok((x, projected))
    }

    /// The last decoder layer and those before it.
    fn split_decoder(&self) -> (&TransformerDecoderLayer, &[TransformerDecoderLayer]) {
        let last = self.decoder.len() - 1;
        (&self.decoder[last], &self.decoder[..last])
    }

    /// Decodes mixture segments `[windows * u, c + u]` against the memory of the same frame; the
    /// code is `[windows, d]`.
    fn decode<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        embedding: Embedding,
        segments: Var,
        memory: Var,
        projected_memory: &[Var],
    ) -> Result<Var, AutogradError> {
        let u = self.positions.nrows();
        let (last, before_last) = self.split_decoder();
        let mut x = tape.linear(segments, embedding.token, None, false)?;
        for (k, (layer, &memory)) in before_last.iter().zip(projected_memory).enumerate() {
            let attention = &layer.self_attention;
            let y = if k == 0 {
                attention.own_narrow(tape, embedding.attention, segments, u)?
            } else {
                attention.own(tape, x, u)?
            };
            x = layer.forward_attended(tape, x, y, memory, u)?;
        }
        let x = last.forward_single(tape, x, memory, u, u / 2)?;
        self.output.forward(tape, x)
    }
}

impl<T: Real> Segments<T> {
    fn frame(&self, frame: usize) -> &[T] {
        let len = self.trajectory.windows * self.channels;
        &self.trajectory.values[frame * len..(frame + 1) * len]
    }

    /// Frame of segment position `j` for the prediction of frame `t + 1`.
    fn frame_at(&self, t: usize, j: usize) -> usize {
        (t + 1 + j)
            .saturating_sub(self.window / 2)
            .min(self.trajectory.frames - 1)
    }

    /// Writes the target segments of all windows for the prediction of frame `t + 1`, each token
    /// followed by `gap` numbers that are left alone.
    fn write_target(&self, t: usize, out: &mut [T], gap: usize) {
        let (u, c) = (self.window, self.channels);
        for (window, out) in out.chunks_exact_mut(u * (c + gap)).enumerate() {
            for (j, token) in out.chunks_exact_mut(c + gap).enumerate() {
                let frame = self.frame(self.frame_at(t, j));
                token[..c].copy_from_slice(&frame[window * c..(window + 1) * c]);
            }
        }
    }

    /// The mixture segment for the prediction of frame `t + 1`, one `[windows, c]` a position.
    fn mixture(&self, tape: &mut Tape<'_, T>, t: usize, fed: impl Fn(usize) -> Var) -> Vec<Var> {
        (0..self.window)
            .map(|j| {
                let frame = self.frame_at(t, j);
                if frame <= t {
                    return fed(frame);
                }
                let shape = [self.trajectory.windows, self.channels];
                tape.constant_with(&shape, |out| out.copy_from_slice(self.frame(frame)))
            })
            .collect()
    }
}

impl Coder<'_> {
    /// The code of the mixture segment for the prediction of frame `t + 1`.
    fn code<T: Real>(
        &mut self,
        tape: &mut Tape<'_, T>,
        segments: &Segments<T>,
        t: usize,
        mixture: Vec<Var>,
    ) -> Result<Var, AutogradError> {
        let (u, c) = (segments.window, segments.channels);
        let rows = segments.trajectory.windows * u;
        let memory = match self.memory.take() {
            Some(memory) if (memory.first..memory.first + memory.frames).contains(&t) => memory,
            _ => self.encode(tape, segments, t)?,
        };
        let parts: Vec<Var> = mixture
            .into_iter()
            .zip(&self.composed.one_hot)
            .flat_map(|(values, &one_hot)| [values, one_hot])
            .collect();
        let mixture = tape.concat(&parts)?;
        let mixture = tape.reshape(mixture, &[rows, c + u])?;
        let mut of_frame = |all: Var| {
            if memory.frames == 1 {
                return Ok(all);
            }
            let from = (t - memory.first) * rows;
            tape.rows(all, from..from + rows)
        };
        let tokens = of_frame(memory.tokens)?;
        let projected = memory
            .projected
            .iter()
            .map(|&all| of_frame(all))
            .collect::<Result<Vec<_>, _>>()?;
        self.memory = Some(memory);
        let embedding = self.composed.mixture;
        self.transformer
            .decode(tape, embedding, mixture, tokens, &projected)
    }

    /// Codes the target segments for the prediction of frame `t + 1`, and of some frames after it
    /// where windows are few.
    fn encode<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        segments: &Segments<T>,
        t: usize,
    ) -> Result<Memory, AutogradError> {
        let (u, c) = (segments.window, segments.channels);
        let windows = segments.trajectory.windows;
        let left = segments.trajectory.frames - 1 - t;
        let frames = (WINDOWS_AT_ONCE / windows.max(1)).clamp(1, left.max(1));
        let rows = windows * u;
        let targets = tape.constant_with(&[frames * rows, c + u], |out| {
            out.fill(T::zero());
            let width = rows * (c + u);
            for (k, out) in out.chunks_exact_mut(width.max(1)).enumerate() {
                segments.write_target(t + k, out, u);
            }
            for (row, token) in out.chunks_exact_mut(c + u).enumerate() {
                token[c + row % u] = T::one();
            }
        });
        let embedding = self.composed.target;
        let (tokens, projected) = self.transformer.encode(tape, embedding, targets, u)?;
        Ok(Memory {
            first: t,
            frames,
            tokens,
            projected,
        })
    }
}

impl<T: Real> Session<'_, T> {
    /// How many of the last fed frames a mixture segment holds.
    pub(super) fn past(window: usize) -> usize {
        window / 2
    }

    /// The code for the prediction of frame `t + 1`, `[windows, d]`. `fed(i)` is what was fed for
    /// frame i, `[windows, c]`, asked for the last `past` frames up to t.
    pub(super) fn code(
        &mut self,
        tape: &mut Tape<'_, T>,
        t: usize,
        fed: impl Fn(usize) -> Var,
    ) -> Result<Var, AutogradError> {
        let segments = &self.segments;
        let mixture = segments.mixture(tape, t, fed);
        match &mut self.kind {
            SessionKind::FullyConnected(mlp) => {
                let width = segments.window * segments.channels;
                let target = tape.constant_with(&[segments.trajectory.windows, width], |out| {
                    segments.write_target(t, out, 0);
                });
                let parts: Vec<Var> = std::iter::once(target).chain(mixture).collect();
                let both = tape.concat(&parts)?;
                mlp.forward(tape, both)
            }
            SessionKind::Transformer(coder) => coder.code(tape, segments, t, mixture),
        }
    }

    /// The values on the tape that later frames need.
    pub(super) fn keep(&mut self) -> Vec<&mut Var> {
        match &mut self.kind {
            SessionKind::FullyConnected(_) => Vec::new(),
            SessionKind::Transformer(coder) => coder
                .memory
                .iter_mut()
                .flat_map(|memory| std::iter::once(&mut memory.tokens).chain(&mut memory.projected))
                .collect(),
        }
    }
}

//! Transformer layers (Vaswani et al. 2017): post-norm, ReLU, no mask; dropout on attention weights
//! and sublayer outputs.

use rand::Rng;

use super::{Initialiser, LayerNorm, Linear, MultiHeadAttention};
use crate::autograd::{AutogradError, Real, Tape, Var};

/// Sizes of a Transformer layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransformerSizes {
    /// d, numbers of a token.
    pub width: usize,
    pub heads: usize,
    pub feed_forward: usize,
    pub dropout: f64,
}

/// Linear, ReLU or GELU, Linear.
#[derive(Debug, Clone, Copy)]
struct FeedForward {
    linear1: Linear,
    linear2: Linear,
    /// GELU in the place of ReLU.
    gelu: bool,
    /// Dropout between activation and second layer.
    dropout: f64,
}

impl FeedForward {
    fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Self {
        let (d, wide) = (sizes.width, sizes.feed_forward);
        Self {
            linear1: Linear::new(init, &format!("{name}.linear1"), d, wide),
            linear2: Linear::new(init, &format!("{name}.linear2"), wide, d),
            gelu: false,
            dropout: 0.0,
        }
    }

    fn forward<T: Real>(&self, tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
        let x = match self.gelu {
            true => {
                let x = self.linear1.forward(tape, x)?;
                tape.gelu(x)
            }
            false => self.linear1.forward_relu(tape, x)?,
        };
        let x = match self.dropout > 0.0 {
            true => tape.dropout(x, self.dropout),
            false => x,
        };
        self.linear2.forward(tape, x)
    }
}

/// Self-attention and feed-forward, as `torch.nn.TransformerEncoderLayer`.
#[derive(Debug, Clone)]
pub struct TransformerEncoderLayer {
    pub self_attention: MultiHeadAttention,
    feed_forward: FeedForward,
    norms: [LayerNorm; 2],
    dropout: f64,
}

impl TransformerEncoderLayer {
    /// Adds `{name}.self_attn`, `.linear1`, `.linear2`, `.norm1`, `.norm2`.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Result<Self, AutogradError> {
        Ok(Self {
            self_attention: MultiHeadAttention::new(init, &format!("{name}.self_attn"), sizes)?,
            feed_forward: FeedForward::new(init, name, sizes),
            norms: [1, 2].map(|k| LayerNorm::new(init, &format!("{name}.norm{k}"), sizes.width)),
            dropout: sizes.dropout,
        })
    }

    /// The same with GELU in the place of ReLU.
    #[must_use]
    pub fn with_gelu(mut self) -> Self {
        self.feed_forward.gelu = true;
        self
    }

    /// The same with dropout inside the feed-forward part, too, as PyTorch's layer has it.
    #[must_use]
    pub fn with_inner_dropout(mut self) -> Self {
        self.feed_forward.dropout = self.dropout;
        self
    }

    /// Tokens `x [windows * tokens, d]`, in windows of `tokens`, to the same shape.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let y = self.self_attention.own(tape, x, tokens)?;
        self.forward_attended(tape, x, y)
    }

    /// [`TransformerEncoderLayer::forward`] where the tokens' attention to each other `y` is there
    /// already; both `[rows, d]`.
    ///
    /// # Errors
    /// Inputs of other widths.
    pub fn forward_attended<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        y: Var,
    ) -> Result<Var, AutogradError> {
        let x = self.norms[0].after(tape, y, x, self.dropout)?;
        let y = self.feed_forward.forward(tape, x)?;
        self.norms[1].after(tape, y, x, self.dropout)
    }
}

/// Self-attention, attention to a memory, feed-forward, as `torch.nn.TransformerDecoderLayer`.
#[derive(Debug, Clone)]
pub struct TransformerDecoderLayer {
    pub self_attention: MultiHeadAttention,
    memory_attention: MultiHeadAttention,
    feed_forward: FeedForward,
    norms: [LayerNorm; 3],
    dropout: f64,
}

impl TransformerDecoderLayer {
    /// Adds `{name}.self_attn`, `.multihead_attn`, `.linear1`, `.linear2`, `.norm1`, `.norm2`,
    /// `.norm3`.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Result<Self, AutogradError> {
        let mut attention =
            |kind: &str| MultiHeadAttention::new(init, &format!("{name}.{kind}"), sizes);
        Ok(Self {
            self_attention: attention("self_attn")?,
            memory_attention: attention("multihead_attn")?,
            feed_forward: FeedForward::new(init, name, sizes),
            norms: [1, 2, 3].map(|k| LayerNorm::new(init, &format!("{name}.norm{k}"), sizes.width)),
            dropout: sizes.dropout,
        })
    }

    /// Keys and values of a memory `[rows, d]` for [`TransformerDecoderLayer::forward_attended`],
    /// `[rows, 2d]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn project_memory<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        memory: Var,
    ) -> Result<Var, AutogradError> {
        self.memory_attention.project_memory(tape, memory)
    }

    /// All tokens `x [windows * tokens, d]` with their attention to each other `y`, likewise, and
    /// the memory's keys and values `[rows, 2d]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward_attended<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        y: Var,
        memory: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let x = self.norms[0].after(tape, y, x, self.dropout)?;
        let y = self.memory_attention.to_memory(tape, x, memory, tokens)?;
        self.finish(tape, x, y)
    }

    /// Token `position` of each window only, `[windows, d]`: all that is asked of a last layer.
    /// `x`, `memory [windows * tokens, d]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward_single<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        memory: Var,
        tokens: usize,
        position: usize,
    ) -> Result<Var, AutogradError> {
        let centre = tape.strided_rows(x, position, tokens)?;
        let y = self.self_attention.single(tape, centre, x, tokens)?;
        let centre = self.norms[0].after(tape, y, centre, self.dropout)?;
        let y = self.memory_attention.single(tape, centre, memory, tokens)?;
        self.finish(tape, centre, y)
    }

    fn finish<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        y: Var,
    ) -> Result<Var, AutogradError> {
        let x = self.norms[1].after(tape, y, x, self.dropout)?;
        let y = self.feed_forward.forward(tape, x)?;
        self.norms[2].after(tape, y, x, self.dropout)
    }
}

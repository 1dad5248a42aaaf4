//! Multi-head attention (Vaswani et al. 2017, section 3.2.2).

use rand::Rng;

use super::transformer::TransformerSizes;
use super::{Initialiser, Linear};
use crate::autograd::ops::attention::{AttentionShape, HeadColumns};
use crate::autograd::ops::query_attention::QueryAttentionWeights;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// Multi-head attention with PyTorch's names: `in_proj_weight [3d, d]` (queries, keys, values; Xavier uniform at first),
/// `in_proj_bias [3d]` (0), `out_proj` (bias 0).
#[derive(Debug, Clone)]
pub struct MultiHeadAttention {
    /// All three projections.
    pub in_projection: Linear,
    queries: Linear,
    keys_and_values: Linear,
    head_keys: Vec<BlockId>,
    head_values: Vec<BlockId>,
    value_bias: BlockId,
    output: Linear,
    sizes: TransformerSizes,
}

impl MultiHeadAttention {
    /// Adds `{name}.in_proj_weight`, `.in_proj_bias`, `.out_proj.weight`, `.out_proj.bias`.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Self {
        let d = sizes.width;
        let head = d / sizes.heads;
        // Xavier uniform for [3d, d].
        let bound = (6.0 / (4 * d) as f64).sqrt();
        let (weight, whole) = init.uniform(format!("{name}.in_proj_weight"), &[3 * d, d], bound);
        let (bias, whole_bias) = init.constant(format!("{name}.in_proj_bias"), &[3 * d], 0.0);
        let out = format!("{name}.out_proj");
        let bound = 1.0 / (d as f64).sqrt();
        let output = Linear {
            weight: init.uniform(format!("{out}.weight"), &[d, d], bound).1,
            bias: init.constant(format!("{out}.bias"), &[d], 0.0).1,
        };
        let heads = |init: &mut Initialiser<'_, T, R>, start: usize| {
            (0..sizes.heads)
                .map(|h| init.rows(weight, start + h * head..start + (h + 1) * head))
                .collect()
        };
        Self {
            in_projection: Linear {
                weight: whole,
                bias: whole_bias,
            },
            queries: Linear {
                weight: init.rows(weight, 0..d),
                bias: init.rows(bias, 0..d),
            },
            keys_and_values: Linear {
                weight: init.rows(weight, d..3 * d),
                bias: init.rows(bias, d..3 * d),
            },
            head_keys: heads(init, d),
            head_values: heads(init, 2 * d),
            value_bias: init.rows(bias, 2 * d..3 * d),
            output,
            sizes,
        }
    }

    fn shape(&self, queries: usize, keys: usize) -> AttentionShape {
        AttentionShape {
            heads: self.sizes.heads,
            width: self.sizes.width,
            queries,
            keys,
        }
    }

    /// Attention of the tokens of each window to each other, from their projections `[windows * tokens, 3d]`, as
    /// `[windows * tokens, d]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn own<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        projected: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let columns = |k: usize| HeadColumns {
            value: projected,
            start: k * self.sizes.width,
        };
        let shape = self.shape(tokens, tokens);
        let y = tape.attention(
            columns(0),
            columns(1),
            columns(2),
            shape,
            self.sizes.dropout,
        )?;
        self.output.forward(tape, y)
    }

    /// The projections of queries, keys and values, `[rows, d]` -> `[rows, 3d]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn project<T: Real>(&self, tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
        self.in_projection.forward(tape, x)
    }

    /// The keys and values of a memory, `[rows, d]` -> `[rows, 2d]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn project_memory<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        memory: Var,
    ) -> Result<Var, AutogradError> {
        self.keys_and_values.forward(tape, memory)
    }

    /// Attention of `x [windows * tokens, d]` to a memory's keys and values `[windows * tokens, 2d]`, as `[windows * tokens, d]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn to_memory<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        keys_and_values: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let value = self.queries.forward(tape, x)?;
        let columns = |k: usize| HeadColumns {
            value: keys_and_values,
            start: k * self.sizes.width,
        };
        let queries = HeadColumns { value, start: 0 };
        let shape = self.shape(tokens, tokens);
        let y = tape.attention(queries, columns(0), columns(1), shape, self.sizes.dropout)?;
        self.output.forward(tape, y)
    }

    /// Attention of one token a window, `x [windows, d]`, to the window's tokens `[windows * tokens, d]` (not projected), as
    /// `[windows, d]`.
    ///
    /// # Errors
    /// Rows that do not fit.
    pub fn single<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: Var,
        count: usize,
    ) -> Result<Var, AutogradError> {
        let q = self.queries.forward(tape, x)?;
        let mut blocks = |ids: &[BlockId]| ids.iter().map(|&id| tape.block(id)).collect();
        let weights = QueryAttentionWeights {
            keys: blocks(&self.head_keys),
            values: blocks(&self.head_values),
            value_bias: tape.block(self.value_bias),
        };
        let y = tape.query_attention(q, tokens, weights, count, self.sizes.dropout)?;
        self.output.forward(tape, y)
    }
}

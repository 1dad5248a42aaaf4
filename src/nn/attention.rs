//! Multi-head attention (Vaswani et al. 2017, section 3.2.2).
//!
//! Where the tokens are linear in a few numbers, x = E s with s [k] and k far below d,
//! self-attention needs no projections of its own: with P = [`in_proj`] E, the score of two tokens
//! is s_i^T (P_q,h^T P_k,h) s_j, and the output O sum_j a_ij P_v s_j is sum_h (O_h P_v,h) (sum_j
//! a_hij s_j). Both matrices in brackets are made once a tape: [`NarrowAttention`].
//!
//! [`in_proj`]: MultiHeadAttention::in_projection

use std::ops::Range;

use rand::Rng;

use super::transformer::TransformerSizes;
use super::{Initialiser, Linear};
use crate::autograd::ops::attention::{AttentionShape, HeadColumns};
use crate::autograd::ops::query_attention::QueryAttentionWeights;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// Multi-head attention with PyTorch's names: `in_proj_weight [3d, d]` (queries, keys, values;
/// Xavier uniform at first), `in_proj_bias [3d]` (0), `out_proj` (bias 0).
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

/// Self-attention of tokens that are linear in k numbers each, made on a tape by
/// [`MultiHeadAttention::narrow`].
#[derive(Debug, Clone, Copy)]
pub struct NarrowAttention {
    /// P_k,h^T P_q,h of each head, `[heads * k, k]`.
    forms: Var,
    /// O_h P_v,h of all heads beside each other, `[d, heads * k]`.
    outputs: Var,
}

impl MultiHeadAttention {
    /// Adds `{name}.in_proj_weight`, `.in_proj_bias`, `.out_proj.weight`, `.out_proj.bias`.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: TransformerSizes,
    ) -> Result<Self, AutogradError> {
        let d = sizes.width;
        if d == 0 || !d.is_multiple_of(sizes.heads) {
            return Err(AutogradError::Argument {
                operation: "attention",
                shape: vec![d],
                argument: format!("{} heads", sizes.heads),
                expected: "a number that divides the width",
            });
        }
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
                .collect::<Result<_, _>>()
        };
        Ok(Self {
            in_projection: Linear {
                weight: whole,
                bias: whole_bias,
            },
            queries: Linear {
                weight: init.rows(weight, 0..d)?,
                bias: init.rows(bias, 0..d)?,
            },
            keys_and_values: Linear {
                weight: init.rows(weight, d..3 * d)?,
                bias: init.rows(bias, d..3 * d)?,
            },
            head_keys: heads(init, d)?,
            head_values: heads(init, 2 * d)?,
            value_bias: init.rows(bias, 2 * d..3 * d)?,
            output,
            sizes,
        })
    }

    fn shape(&self, queries: usize, keys: usize) -> AttentionShape {
        AttentionShape {
            heads: self.sizes.heads,
            width: self.sizes.width,
            queries,
            keys,
        }
    }

    /// Attention of the tokens of each window to each other, `[windows * tokens, d]` to the same
    /// shape.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn own<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        self.own_biased(tape, x, tokens, None)
    }

    /// [`MultiHeadAttention::own`] with `bias [1 or heads, tokens, tokens]` added to the scores.
    ///
    /// # Errors
    /// Rows that are no whole windows, a bias of another shape.
    pub fn own_biased<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        tokens: usize,
        bias: Option<Var>,
    ) -> Result<Var, AutogradError> {
        let projected = self.in_projection.forward(tape, x)?;
        let columns = |k: usize| HeadColumns {
            value: projected,
            start: k * self.sizes.width,
        };
        let shape = self.shape(tokens, tokens);
        let operands = [0, 1, 2].map(columns);
        let y = tape.attention(operands, shape, bias, self.sizes.dropout)?;
        self.output.forward(tape, y)
    }

    /// Attention of some tokens of each window, `asking [windows * queries, d]`, to all of them,
    /// `x [windows * tokens, d]`, with `bias [1 or heads, queries, tokens]` added to the scores, as
    /// `[windows * queries, d]`.
    ///
    /// # Errors
    /// Rows that are no whole windows, a bias of another shape.
    pub fn some_biased<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        (asking, queries): (Var, usize),
        (x, tokens): (Var, usize),
        bias: Option<Var>,
    ) -> Result<Var, AutogradError> {
        let value = self.queries.forward(tape, asking)?;
        let memory = self.project_memory(tape, x)?;
        let columns = |k: usize| HeadColumns {
            value: memory,
            start: k * self.sizes.width,
        };
        let operands = [HeadColumns { value, start: 0 }, columns(0), columns(1)];
        let shape = self.shape(queries, tokens);
        let y = tape.attention(operands, shape, bias, self.sizes.dropout)?;
        self.output.forward(tape, y)
    }

    /// Self-attention for tokens that are linear in k numbers: `basis [k, d]` are the tokens of the
    /// k unit vectors. Every token is their sum with weights of which those at `ones` add up to 1;
    /// the projections' bias goes there.
    ///
    /// # Errors
    /// A basis of another width, or without the numbers at `ones`.
    pub fn narrow<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        basis: Var,
        ones: Range<usize>,
    ) -> Result<NarrowAttention, AutogradError> {
        let TransformerSizes {
            width: d, heads, ..
        } = self.sizes;
        let shape = tape.shape(basis);
        let k = shape.first().copied().unwrap_or(0);
        if ones.start > ones.end || ones.end > k {
            return Err(AutogradError::Argument {
                operation: "attention",
                shape: shape.to_vec(),
                argument: format!("ones at {ones:?}"),
                expected: "a range of its rows",
            });
        }
        let weight = tape.block(self.in_projection.weight);
        let projected = tape.linear(basis, weight, None, false)?;
        let mask = tape.constant_with(&[k, 1], |out| {
            out.fill(T::zero());
            out[ones].fill(T::one());
        });
        let bias = tape.block(self.in_projection.bias);
        let bias = tape.reshape(bias, &[1, 3 * d])?;
        let bias = tape.mul(bias, mask)?;
        let projected = tape.add(projected, bias)?;
        let output = tape.block(self.output.weight);
        let (mut forms, mut outputs) = (Vec::new(), Vec::new());
        for h in 0..heads {
            let columns = |part: usize| {
                let start = part * d + h * (d / heads);
                start..start + d / heads
            };
            let [q, k, v] = [0, 1, 2].map(|part| tape.columns(projected, columns(part)));
            forms.push(tape.linear(k?, q?, None, false)?);
            let output = tape.columns(output, columns(0))?;
            outputs.push(tape.linear(output, v?, None, false)?);
        }
        let forms = tape.stack(&forms)?;
        Ok(NarrowAttention {
            forms: tape.reshape(forms, &[heads * k, k])?,
            outputs: tape.concat(&outputs)?,
        })
    }

    /// [`MultiHeadAttention::own`] for the tokens that `narrow` is made for, from their numbers
    /// `[windows * tokens, k]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn own_narrow<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        narrow: NarrowAttention,
        numbers: Var,
        tokens: usize,
    ) -> Result<Var, AutogradError> {
        let TransformerSizes {
            width,
            heads,
            dropout,
            ..
        } = self.sizes;
        let scale = 1.0 / ((width / heads) as f64).sqrt();
        let queries = tape.linear(numbers, narrow.forms, None, false)?;
        let y = tape.shared_attention(queries, numbers, tokens, scale, dropout)?;
        let bias = tape.block(self.output.bias);
        tape.linear(y, narrow.outputs, Some(bias), false)
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

    /// Attention of `x [windows * tokens, d]` to a memory's keys and values
    /// `[windows * tokens, 2d]`, as `[windows * tokens, d]`.
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
        let operands = [queries, columns(0), columns(1)];
        let y = tape.attention(operands, shape, None, self.sizes.dropout)?;
        self.output.forward(tape, y)
    }

    /// Attention of one token a window, `x [windows, d]`, to the window's tokens
    /// `[windows * tokens, d]` (not projected), as `[windows, d]`.
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

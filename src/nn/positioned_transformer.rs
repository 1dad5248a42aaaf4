//! A Transformer that knows where its tokens stand by a learned bias of its attention scores:
//! relative as in T5 (Raffel et al. 2020, section 2.1), or a table.

use std::sync::Arc;

use rand::Rng;
use serde::{Deserialize, Serialize};

use super::{Initialiser, Linear, TransformerEncoderLayer, TransformerSizes};
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// Buckets of T5's relative positions.
const BUCKETS: usize = 32;
/// Distances from which on the buckets of one direction widen.
const THRESHOLDS: [i64; 8] = [8, 12, 16, 23, 32, 46, 64, 91];
/// Bound of the output layer's first weights.
const OUTPUT_BOUND: f64 = 0.1;

/// What is added to a score for the places of its two tokens.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Positions {
    /// A number a head for the bucket of their distance.
    T5,
    /// A number for each pair of tokens, one for all heads.
    Table,
    /// Nothing.
    None,
}

/// The place of a token.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Frames.
    pub time: i64,
    /// What it is of: each pair of modalities has buckets of its own.
    pub modality: usize,
}

/// Sizes of a [`PositionedTransformer`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionedSizes {
    /// Numbers of a token that goes in.
    pub inputs: usize,
    /// Numbers of a token that comes out.
    pub outputs: usize,
    pub layers: usize,
    /// Of its layers.
    pub layer: TransformerSizes,
    /// All weights of the output layer 0 at first; else uniform within 0.1.
    pub zero_output: bool,
}

/// Linear, post-norm layers without a mask, Linear.
#[derive(Debug, Clone)]
pub struct PositionedTransformer {
    input: Linear,
    layers: Vec<TransformerEncoderLayer>,
    bias: Option<Bias>,
    output: Linear,
    tokens: usize,
}

#[derive(Debug, Clone)]
enum Bias {
    /// `[buckets, heads]`, and the bucket of every pair of tokens, `[tokens, tokens]`.
    T5(BlockId, Arc<[usize]>),
    /// `[tokens, tokens]`
    Table(BlockId),
}

/// The bucket of a key's time less a query's, below 32.
pub fn t5_bucket(delta: i64) -> usize {
    let distance = delta.saturating_abs();
    let bucket = match usize::try_from(distance) {
        Ok(near) if near < 8 => near,
        _ => 7 + THRESHOLDS.iter().filter(|&&it| distance >= it).count(),
    };
    bucket + if delta > 0 { BUCKETS / 2 } else { 0 }
}

impl PositionedTransformer {
    /// Adds `{name}.input`, `.layers.{i}`, `.relative_bias.weight [32 pairs, heads]` (T5) or
    /// `.relative_bias.table [tokens, tokens]`, and `.output`, for windows of tokens at `places`.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: PositionedSizes,
        positions: Positions,
        places: &[Place],
    ) -> Result<Self, AutogradError> {
        let width = sizes.layer.width;
        let input = Linear::new(init, &format!("{name}.input"), sizes.inputs, width);
        let layers = (0..sizes.layers)
            .map(|i| TransformerEncoderLayer::new(init, &format!("{name}.layers.{i}"), sizes.layer))
            .collect::<Result<_, _>>()?;
        let tokens = places.len();
        let bias = match positions {
            Positions::None => None,
            Positions::Table => {
                let name = format!("{name}.relative_bias.table");
                Some(Bias::Table(init.constant(name, &[tokens, tokens], 0.0).1))
            }
            Positions::T5 => {
                let name = format!("{name}.relative_bias.weight");
                let modalities = places.iter().map(|place| place.modality + 1).max();
                let modalities = modalities.unwrap_or(1);
                let shape = [BUCKETS * modalities * modalities, sizes.layer.heads];
                let bucket = |query: &Place, key: &Place| {
                    let pair = query.modality * modalities + key.modality;
                    pair * BUCKETS + t5_bucket(key.time - query.time)
                };
                let of_query = |query| places.iter().map(move |key| bucket(query, key));
                let buckets = places.iter().flat_map(of_query).collect();
                Some(Bias::T5(init.constant(name, &shape, 0.0).1, buckets))
            }
        };
        let output = format!("{name}.output");
        let output = match sizes.zero_output {
            true => Linear::of_zeros(init, &output, width, sizes.outputs),
            false => {
                let shape = [sizes.outputs, width];
                let weight = init.uniform(format!("{output}.weight"), &shape, OUTPUT_BOUND);
                let bias = init.constant(format!("{output}.bias"), &shape[..1], 0.0);
                Linear {
                    weight: weight.1,
                    bias: bias.1,
                }
            }
        };
        Ok(Self {
            input,
            layers,
            bias,
            output,
            tokens,
        })
    }

    /// What is added to the scores of the first `queries` tokens of a window,
    /// `[heads or 1, queries, tokens]`.
    fn bias<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        queries: usize,
    ) -> Result<Option<Var>, AutogradError> {
        Ok(match &self.bias {
            None => None,
            Some(Bias::T5(weight, buckets)) => {
                let weight = tape.block(*weight);
                let some: Arc<[usize]> = match queries == self.tokens {
                    true => buckets.clone(),
                    false => buckets[..queries * self.tokens].into(),
                };
                Some(tape.relative_bias(weight, &some, queries)?)
            }
            Some(Bias::Table(table)) => {
                let table = tape.block(*table);
                let some = tape.rows(table, 0..queries)?;
                Some(tape.reshape(some, &[1, queries, self.tokens])?)
            }
        })
    }

    /// Tokens `[windows * tokens, inputs]` to what the first `asking` of each window become,
    /// `[windows * asking, outputs]`: in the last layer no others ask.
    ///
    /// # Errors
    /// Rows that are no whole windows; more asking than there are.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        asking: usize,
    ) -> Result<Var, AutogradError> {
        if asking == 0 || asking > self.tokens {
            return Err(AutogradError::Argument {
                operation: "positioned_transformer",
                shape: vec![self.tokens],
                argument: format!("{asking} tokens that ask"),
                expected: "at least one, and no more than a window has",
            });
        }
        let mut x = self.input.forward(tape, x)?;
        let all = match self.layers.len() {
            0 | 1 if asking < self.tokens => None,
            _ => self.bias(tape, self.tokens)?,
        };
        for (i, layer) in self.layers.iter().enumerate() {
            if i + 1 < self.layers.len() || asking == self.tokens {
                let attention = &layer.self_attention;
                let y = attention.own_biased(tape, x, self.tokens, all)?;
                x = layer.forward_attended(tape, x, y)?;
            } else {
                let bias = self.bias(tape, asking)?;
                let first = first_rows(tape, x, self.tokens, asking)?;
                let attention = &layer.self_attention;
                let y = attention.some_biased(tape, (first, asking), (x, self.tokens), bias)?;
                x = layer.forward_attended(tape, first, y)?;
            }
        }
        if self.layers.is_empty() && asking < self.tokens {
            x = first_rows(tape, x, self.tokens, asking)?;
        }
        self.output.forward(tape, x)
    }
}

/// The first `count` rows of each window of `tokens` rows, `[windows * count, d]`.
fn first_rows<T: Real>(
    tape: &mut Tape<'_, T>,
    x: Var,
    tokens: usize,
    count: usize,
) -> Result<Var, AutogradError> {
    let (rows, d) = match *tape.shape(x) {
        [rows, d] => (rows, d),
        _ => (0, 0),
    };
    let windows = rows / tokens.max(1);
    let windowed = tape.reshape(x, &[windows, tokens * d])?;
    let first = tape.columns(windowed, 0..count * d)?;
    tape.reshape(first, &[windows * count, d])
}

//! Multi-head attention over many small windows, as one kernel, and the core it shares with [`super::shared_attention`].
//!
//! ```text
//! Q, K, V are columns of values with the windows' tokens as rows: q rows [windows * tq], k and v rows [windows * tk], each head h
//! has columns h * dh .. (h + 1) * dh. For each window and head:
//! S = scale Q K^T [tq, tk], P = softmax(S), D = dropout(P), Y = D V, scale = 1 / sqrt(dh).
//! dV = D^T dY, dD = dY V^T, dP = dropout(dD) with the same mask, dS = P (dP - rowsum(dP P)),
//! dQ = scale dS K, dK = scale dS^T Q.
//! ```
//!
//! Rows of S, P, D are padded to a multiple of 8 numbers, so that the loops over tk are whole vectors.

use super::{argument_error, shapes_error};
use crate::autograd::kernels::{
    CHUNK, WindowRows, WindowWeights, dropout_into, scratch_len, vectorised, window_scores,
    window_softmax, window_softmax_backward, window_sums,
};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

/// The columns from `start` of a value `[rows, n]`: Q, K or V, wherever a layer's product put them.
#[derive(Debug, Clone, Copy)]
pub struct HeadColumns {
    pub value: Var,
    pub start: usize,
}

/// Sizes of a windowed attention.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttentionShape {
    /// Number of heads.
    pub heads: usize,
    /// Columns of all heads together.
    pub width: usize,
    /// Tokens of a window that ask.
    pub queries: usize,
    /// Tokens of a window that are asked.
    pub keys: usize,
}

impl AttentionShape {
    fn head_width(&self) -> usize {
        self.width / self.heads
    }

    fn padded_keys(&self) -> usize {
        self.keys.next_multiple_of(CHUNK)
    }
}

/// Q, K or V in a value whose rows are `stride` numbers long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operand {
    pub(super) columns: HeadColumns,
    pub(super) stride: usize,
}

impl Operand {
    /// Rows of `window`, of `tokens` each, with the columns of `head`.
    #[inline(always)]
    fn window<'v, T>(
        &self,
        values: &'v [T],
        (window, tokens): (usize, usize),
        (head, width): (usize, usize),
    ) -> WindowRows<'v, T> {
        let whole = WindowRows {
            values,
            start: self.columns.start,
            stride: self.stride,
        };
        whole.from(window * tokens, head * width)
    }
}

struct Attention<T> {
    q: Operand,
    k: Operand,
    v: Operand,
    shape: AttentionShape,
    scale: f64,
    dropout: Option<(u64, f64)>,
    /// P, `[windows, heads, queries, padded keys]`.
    probabilities: Vec<T>,
}

/// What a gradient is a sum of: rows of `other`, weighted by P or dS.
struct Sum<'w, T> {
    /// `[windows, heads, queries, padded keys]`
    weights: &'w [T],
    /// Whether a result is a key's, a sum over the queries.
    of_keys: bool,
    other: (Operand, &'w [T]),
}

impl<T: Real> Attention<T> {
    /// Adds the sums to the gradient of `of`.
    fn add_sums(
        &self,
        context: &mut Backward<'_, T>,
        of: Operand,
        sum: Sum<'_, T>,
        scratch: &mut [T],
    ) {
        let Some(target) = context.target(of.columns.value) else {
            return;
        };
        if target.fresh {
            target.data.fill(T::zero());
        }
        let data = target.data;
        let shape = self.shape;
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let block = shape.queries * padded;
        let (results, others, result, row) = if sum.of_keys {
            (shape.keys, shape.queries, 1, padded)
        } else {
            (shape.queries, shape.keys, padded, 1)
        };
        vectorised(
            #[inline(always)]
            || {
                for (k, values) in sum.weights.chunks_exact(block).enumerate() {
                    let (window, head) = (k / shape.heads, k % shape.heads);
                    let from = window * results * of.stride + of.columns.start + head * width;
                    let (other, other_values) = sum.other;
                    let x = other.window(other_values, (window, others), (head, width));
                    let weights = WindowWeights {
                        values,
                        result,
                        row,
                    };
                    let out = (&mut data[from..], of.stride, results);
                    window_sums(out, weights, (x, others), width, true, scratch);
                }
            },
        );
    }
}

impl<T: Real> Operation<T> for Attention<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let shape = self.shape;
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let block = shape.queries * padded;
        let values = |operand: Operand| context.values(operand.columns.value);
        let (q, k, v) = (values(self.q), values(self.k), values(self.v));
        // The output's rows hold all heads, and nothing else.
        let upstream = Operand {
            columns: HeadColumns {
                start: 0,
                ..self.q.columns
            },
            stride: shape.width,
        };
        let dy = &*dy;
        let p = &self.probabilities;
        let mut scratch = context.take(scratch_len(shape.queries.max(shape.keys), width));

        let mut dropped = context.take(p.len());
        match self.dropout {
            Some((key, rate)) => dropout_into(key, rate, p, &mut dropped),
            None => dropped.copy_from_slice(p),
        }
        let sum = Sum {
            weights: &dropped,
            of_keys: true,
            other: (upstream, dy),
        };
        self.add_sums(context, self.v, sum, &mut scratch);

        let mut ds = dropped;
        vectorised(
            #[inline(always)]
            || {
                for (k, ds) in ds.chunks_exact_mut(block).enumerate() {
                    let (window, head) = (k / shape.heads, (k % shape.heads, width));
                    let a = upstream.window(dy, (window, shape.queries), head);
                    let b = self.v.window(v, (window, shape.keys), head);
                    window_scores(ds, a, (b, shape.keys), width, T::one(), &mut scratch);
                }
            },
        );
        if let Some((key, rate)) = self.dropout {
            let mut dp = context.take(ds.len());
            dropout_into(key, rate, &ds, &mut dp);
            context.give(std::mem::replace(&mut ds, dp));
        }
        vectorised(
            #[inline(always)]
            || window_softmax_backward(&mut ds, p, shape.keys, T::from_f64(self.scale)),
        );
        for (of, of_keys, other) in [(self.q, false, (self.k, k)), (self.k, true, (self.q, q))] {
            let sum = Sum {
                weights: &ds,
                of_keys,
                other,
            };
            self.add_sums(context, of, sum, &mut scratch);
        }
        context.give(ds);
        context.give(scratch);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.probabilities));
    }
}

/// Records an attention whose operands are known to fit; the output has `shape.width` columns for each query.
pub(super) fn record<T: Real>(
    tape: &mut Tape<'_, T>,
    name: &'static str,
    (q, k, v): (Operand, Operand, Operand),
    (windows, shape): (usize, AttentionShape),
    scale: f64,
    p: f64,
    output: &[usize],
) -> Var {
    let (width, padded) = (shape.head_width(), shape.padded_keys());
    let block = shape.queries * padded;
    let mut probabilities = tape.take(windows * shape.heads * block);
    let mut scratch = tape.take(scratch_len(shape.queries.max(shape.keys), width));
    let mut y = tape.take(windows * shape.queries * shape.width);
    let dropout = tape
        .next_dropout_key()
        .filter(|_| p > 0.0)
        .map(|key| (key, p));
    let mut dropped = match dropout {
        Some(_) => tape.take(probabilities.len()),
        None => Vec::new(),
    };
    let values = |operand: Operand| tape.values(operand.columns.value);
    let (queries, keys, values) = (values(q), values(k), values(v));
    vectorised(
        #[inline(always)]
        || {
            for (row, out) in probabilities.chunks_exact_mut(block).enumerate() {
                let (window, head) = (row / shape.heads, (row % shape.heads, width));
                let a = q.window(queries, (window, shape.queries), head);
                let b = k.window(keys, (window, shape.keys), head);
                let scale = T::from_f64(scale);
                window_scores(out, a, (b, shape.keys), width, scale, &mut scratch);
            }
            window_softmax(&mut probabilities, shape.keys);
        },
    );
    let weights = match dropout {
        Some((key, p)) => {
            dropout_into(key, p, &probabilities, &mut dropped);
            &dropped
        }
        None => &probabilities,
    };
    vectorised(
        #[inline(always)]
        || {
            for (row, weights) in weights.chunks_exact(block).enumerate() {
                let (window, head) = (row / shape.heads, row % shape.heads);
                let from = window * shape.queries * shape.width + head * width;
                let x = v.window(values, (window, shape.keys), (head, width));
                let weights = WindowWeights {
                    values: weights,
                    result: padded,
                    row: 1,
                };
                let out = (&mut y[from..], shape.width, shape.queries);
                window_sums(out, weights, (x, shape.keys), width, false, &mut scratch);
            }
        },
    );
    tape.give(scratch);
    tape.give(dropped);
    if !tape.is_recording() {
        tape.give(std::mem::take(&mut probabilities));
    }
    let inputs = [q, k, v].map(|operand| operand.columns.value);
    tape.record(name, &inputs, output, y, || Attention {
        q,
        k,
        v,
        shape,
        scale,
        dropout,
        probabilities,
    })
}

impl<T: Real> Tape<'_, T> {
    /// Attention of `shape.queries` tokens to `shape.keys` tokens within each window, as `[windows * queries, width]`; dropout
    /// with probability `p` on the attention weights.
    ///
    /// # Errors
    /// Heads that do not divide the width, columns beyond a value, rows that are no whole windows.
    pub fn attention(
        &mut self,
        q: HeadColumns,
        k: HeadColumns,
        v: HeadColumns,
        shape: AttentionShape,
        p: f64,
    ) -> Result<Var, AutogradError> {
        let windows = self.windows(q, shape.queries, shape)?;
        for other in [k, v] {
            if self.windows(other, shape.keys, shape)? != windows {
                let (left, right) = (self.shape(q.value), self.shape(other.value));
                let expected = "as many windows of queries as of keys";
                return Err(shapes_error("attention", left, right, expected));
            }
        }
        let operand = |columns: HeadColumns| Operand {
            columns,
            stride: self.rows_and_columns(columns.value).1,
        };
        let operands = (operand(q), operand(k), operand(v));
        let scale = 1.0 / (shape.head_width() as f64).sqrt();
        let output = [windows * shape.queries, shape.width];
        let sizes = (windows, shape);
        Ok(record(
            self,
            "attention",
            operands,
            sizes,
            scale,
            p,
            &output,
        ))
    }

    /// Number of windows of `tokens` rows in a value that holds the columns of all heads.
    fn windows(
        &self,
        columns: HeadColumns,
        tokens: usize,
        shape: AttentionShape,
    ) -> Result<usize, AutogradError> {
        let found = self.shape(columns.value);
        let fits = shape.heads > 0
            && shape.width > 0
            && shape.width.is_multiple_of(shape.heads)
            && tokens > 0;
        match *found {
            [rows, n] if fits && rows % tokens == 0 && columns.start + shape.width <= n => {
                Ok(rows / tokens)
            }
            _ => Err(argument_error(
                "attention",
                found,
                format!("{shape:?} with columns from {}", columns.start),
                "[windows * tokens, start + width or more], heads that divide the width",
            )),
        }
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use super::{AttentionShape, HeadColumns};
    use crate::autograd::check::property::{Case, case, strength};

    /// Self-attention with Q, K, V in one value, and attention between two values; with and without dropout; more keys than
    /// a padded chunk; small scores and large.
    pub fn cases() -> BoxedStrategy<Case> {
        (
            0usize..3,
            1usize..3,
            1usize..3,
            1usize..4,
            1usize..11,
            any::<bool>(),
            strength(),
            any::<u64>(),
        )
            .prop_map(
                |(windows, heads, head_width, queries, keys, dropout, strength, seed)| {
                    let width = heads * head_width;
                    let shapes: [&[usize]; 2] = [
                        &[windows * queries, 3 * width],
                        &[windows * keys, 2 * width],
                    ];
                    case(&shapes, seed, 0.0, move |tape, v| {
                        tape.set_dropout(dropout.then_some(seed));
                        let asking = tape.affine(v[0], strength, 0.0);
                        let columns = |value, k: usize| HeadColumns {
                            value,
                            start: k * width,
                        };
                        let mut shape = AttentionShape {
                            heads,
                            width,
                            queries,
                            keys: queries,
                        };
                        let (q, k, w) = (columns(asking, 0), columns(v[0], 1), columns(v[0], 2));
                        let own = tape.attention(q, k, w, shape, 0.3)?;
                        shape.keys = keys;
                        let (k, w) = (columns(v[1], 0), columns(v[1], 1));
                        let other = tape.attention(q, k, w, shape, 0.3)?;
                        tape.add(own, other)
                    })
                },
            )
            .boxed()
    }
}

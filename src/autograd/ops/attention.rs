//! Multi-head attention over many small windows, as one kernel; also the record of
//! `shared_attention`.
//!
//! ```text
//! Q, K, V are columns of values with the windows' tokens as rows: q rows [windows * tq],
//! k and v rows [windows * tk], each head h has columns h * dh .. (h + 1) * dh;
//! B [1 or heads, tq, tk]. For each window and head:
//! S = scale Q K^T + B [tq, tk], P = softmax(S), D = dropout(P), Y = D V, scale = 1 / sqrt(dh).
//! dV = D^T dY, dD = dY V^T, dP = dropout(dD) with the same mask, dS = P (dP - rowsum(dP P)),
//! dQ = scale dS K, dK = scale dS^T Q, dB = sum of dS over windows (and heads).
//! ```
//!
//! Rows of S, P, D are padded to a multiple of 8 numbers, so that the loops over tk are whole
//! vectors.

use super::attention_core::{Sums, scores, softmax_gradient};
use super::{argument_error, shapes_error};
use crate::autograd::kernels::{
    CHUNK, WindowRows, drop_in_place, scratch_len, vectorised, window_softmax,
};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

/// Numbers of scores, about, that are in the second-level cache from S to Y and back.
const GROUP: usize = 1 << 15;

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
    pub(super) fn head_width(&self) -> usize {
        self.width / self.heads
    }

    pub(super) fn padded_keys(&self) -> usize {
        self.keys.next_multiple_of(CHUNK)
    }

    /// Numbers in the scores of a window and head.
    pub(super) fn block(&self) -> usize {
        self.queries * self.padded_keys()
    }

    /// Numbers in the scores of the pairs that are done one after the other before the next.
    fn group(&self) -> usize {
        (GROUP / self.block()).max(1) * self.block()
    }

    pub(super) fn scratch_len(&self) -> usize {
        scratch_len(self.queries.max(self.keys), self.head_width())
    }
}

/// Q, K or V in a value whose rows are `stride` numbers long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Operand {
    pub(super) columns: HeadColumns,
    pub(super) stride: usize,
}

impl Operand {
    fn rows<'v, T>(&self, values: &'v [T]) -> WindowRows<'v, T> {
        WindowRows {
            values,
            start: self.columns.start,
            stride: self.stride,
        }
    }
}

/// An attention whose operands are known to fit.
pub(super) struct Attention<T> {
    pub(super) q: Operand,
    pub(super) k: Operand,
    pub(super) v: Operand,
    /// B, `[1 or heads, queries, keys]`.
    pub(super) bias: Option<Var>,
    pub(super) shape: AttentionShape,
    pub(super) scale: f64,
    pub(super) dropout: Option<(u64, f64)>,
    /// P, `[windows, heads, queries, padded keys]`.
    pub(super) probabilities: Vec<T>,
}

impl<T: Real> Attention<T> {
    /// Adds the sums to the gradient of `of`.
    fn add(
        &self,
        context: &mut Backward<'_, T>,
        of: Operand,
        sums: Sums<'_, T>,
        scratch: &mut [T],
    ) {
        if let Some(target) = context.target(of.columns.value) {
            let place = (of.columns.start, of.stride);
            sums.put(target.so_far(), place, self.shape, true, scratch);
        }
    }

    /// Where the rows of a pair begin in B, or in its gradient, of so many numbers.
    fn bias_of(&self, numbers: usize, pair: usize) -> usize {
        let block = self.shape.queries * self.shape.keys;
        pair % (numbers / block) * block
    }

    /// Adds B to the scores of the pairs from `first` on.
    fn add_bias(&self, (scores, first): (&mut [T], usize), bias: &[T]) {
        let (keys, padded) = (self.shape.keys, self.shape.padded_keys());
        for (pair, scores) in (first..).zip(scores.chunks_exact_mut(self.shape.block())) {
            let rows = bias[self.bias_of(bias.len(), pair)..].chunks_exact(keys);
            for (scores, bias) in scores.chunks_exact_mut(padded).zip(rows) {
                scores.iter_mut().zip(bias).for_each(|(s, &b)| *s += b);
            }
        }
    }

    fn bias_gradient(&self, context: &mut Backward<'_, T>, bias: Var, (ds, first): (&[T], usize)) {
        let (keys, padded) = (self.shape.keys, self.shape.padded_keys());
        let Some(target) = context.target(bias) else {
            return;
        };
        let dbias = target.so_far();
        for (pair, ds) in (first..).zip(ds.chunks_exact(self.shape.block())) {
            let from = self.bias_of(dbias.len(), pair);
            let rows = dbias[from..].chunks_exact_mut(keys);
            for (dbias, ds) in rows.zip(ds.chunks_exact(padded)) {
                dbias.iter_mut().zip(ds).for_each(|(db, &ds)| *db += ds);
            }
        }
    }

    /// Records the operation; the output, of shape `output`, has `width` numbers for each query.
    pub(super) fn record(
        mut self,
        tape: &mut Tape<'_, T>,
        name: &'static str,
        output: &[usize],
    ) -> Var {
        let shape = self.shape;
        let mut inputs = [self.q, self.k, self.v].map(|of| of.columns.value).to_vec();
        inputs.extend(self.bias);
        let numbers: usize = output.iter().product();
        if numbers == 0 {
            // However many tokens a window would have.
            return tape.put(name, &inputs, output, Vec::new(), || self);
        }
        let windows = numbers / (shape.queries * shape.width);
        let mut p = tape.take(windows * shape.heads * shape.block());
        let mut dropped = match self.dropout {
            Some(_) => tape.take(shape.group().min(p.len())),
            None => Vec::new(),
        };
        let mut scratch = tape.take(shape.scratch_len());
        let mut y = tape.take(numbers);
        let [q, k, v] = [self.q, self.k, self.v]
            .map(|operand| operand.rows(tape.values(operand.columns.value)));
        let scale = T::from_f64(self.scale);
        let mut first = 0;
        for p in p.chunks_mut(shape.group()) {
            scores((p, first), (q, k), shape, scale, &mut scratch);
            if let Some(bias) = self.bias {
                self.add_bias((p, first), tape.values(bias));
            }
            vectorised(
                #[inline(always)]
                || window_softmax(p, shape.keys),
            );
            let weights = match self.dropout {
                None => p,
                Some(_) => {
                    let dropped = &mut dropped[..p.len()];
                    dropped.copy_from_slice(p);
                    drop_in_place(self.dropout, first * shape.block(), dropped);
                    dropped
                }
            };
            let sums = Sums {
                weights,
                first,
                for_keys: false,
                rows: v,
            };
            sums.put(&mut y, (0, shape.width), shape, false, &mut scratch);
            first += weights.len() / shape.block();
        }
        tape.give(scratch);
        tape.give(dropped);
        if tape.is_recording() {
            self.probabilities = p;
        } else {
            tape.give(p);
        }
        tape.put(name, &inputs, output, y, || self)
    }
}

impl<T: Real> Operation<T> for Attention<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (shape, p) = (self.shape, &self.probabilities);
        let [q, k, v] = [self.q, self.k, self.v]
            .map(|operand| operand.rows(context.values(operand.columns.value)));
        // The output's rows hold all heads, and nothing else.
        let upstream = WindowRows {
            values: &*dy,
            start: 0,
            stride: shape.width,
        };
        let mut scratch = context.take(shape.scratch_len());
        let scale = T::from_f64(self.scale);
        let [mut dropped, mut ds] = [(); 2].map(|()| context.take(shape.group().min(p.len())));
        let mut first = 0;
        for p in p.chunks(shape.group()) {
            let (dropped, ds) = (&mut dropped[..p.len()], &mut ds[..p.len()]);
            dropped.copy_from_slice(p);
            drop_in_place(self.dropout, first * shape.block(), dropped);
            let sums = |weights, for_keys, rows| Sums {
                weights,
                first,
                for_keys,
                rows,
            };
            self.add(context, self.v, sums(dropped, true, upstream), &mut scratch);

            scores((ds, first), (upstream, v), shape, T::one(), &mut scratch);
            let softmax_scale = if self.bias.is_some() { T::one() } else { scale };
            let place = (&mut *ds, first * shape.block());
            softmax_gradient(place, self.dropout, p, shape.keys, softmax_scale);
            if let Some(bias) = self.bias {
                self.bias_gradient(context, bias, (ds, first));
                ds.iter_mut().for_each(|ds| *ds *= scale);
            }
            self.add(context, self.q, sums(ds, false, k), &mut scratch);
            self.add(context, self.k, sums(ds, true, q), &mut scratch);
            first += p.len() / shape.block();
        }
        context.give(dropped);
        context.give(ds);
        context.give(scratch);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.probabilities));
    }
}

impl<T: Real> Tape<'_, T> {
    /// Attention of `shape.queries` tokens to `shape.keys` tokens within each window, as
    /// `[windows * queries, width]`; `bias [1 or heads, queries, keys]`, the same in every window,
    /// is added to the scores (negative infinity masks a key, but not all keys of a query); dropout
    /// with probability `p` on the attention weights.
    ///
    /// # Errors
    /// Heads that do not divide the width, columns beyond a value, rows that are no whole windows,
    /// a bias of another shape, a probability that is none.
    pub fn attention(
        &mut self,
        [q, k, v]: [HeadColumns; 3],
        shape: AttentionShape,
        bias: Option<Var>,
        p: f64,
    ) -> Result<Var, AutogradError> {
        let mut operands = [q, k, v].map(|columns| columns.value).to_vec();
        operands.extend(bias);
        self.own("attention", &operands)?;
        let windows = self.windows(q, shape.queries, shape)?;
        for other in [k, v] {
            if self.windows(other, shape.keys, shape)? != windows {
                let (left, right) = (self.shape(q.value), self.shape(other.value));
                let expected = "as many windows of queries as of keys";
                return Err(shapes_error("attention", left, right, expected));
            }
        }
        if let Some(bias) = bias {
            let wanted = [shape.heads, shape.queries, shape.keys];
            let found = self.shape(bias);
            if found != wanted && found != [1, shape.queries, shape.keys] {
                let expected = "a bias [1 or heads, queries, keys]";
                return Err(shapes_error("attention", &wanted, found, expected));
            }
        }
        let operand = |columns: HeadColumns| Operand {
            columns,
            stride: self.rows_and_columns(columns.value).1,
        };
        let attention = Attention {
            q: operand(q),
            k: operand(k),
            v: operand(v),
            bias,
            shape,
            scale: 1.0 / (shape.head_width() as f64).sqrt(),
            dropout: self.next_draws("attention", p)?,
            probabilities: Vec::new(),
        };
        let output = [windows * shape.queries, shape.width];
        Ok(attention.record(self, "attention", &output))
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
            [rows, n]
                if fits && rows % tokens == 0 && columns.start.saturating_add(shape.width) <= n =>
            {
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
    use crate::autograd::check::property::{Cases, case, drawn, strength};

    /// Self-attention with Q, K, V in one value, and attention between two values; with and without
    /// dropout; without a bias and with one for all heads or for each; more keys than a padded
    /// chunk, and so many that products are general ones; small scores and large.
    pub fn cases() -> Cases {
        let keys = prop_oneof![4 => 1usize..11, 1 => 63usize..67];
        let sizes = (0usize..3, 1usize..3, 1usize..3, 1usize..4, keys);
        let biases = prop_oneof![Just(None), Just(Some(1)), Just(Some(2))];
        let inputs = (sizes, biases, any::<bool>(), strength());
        drawn(inputs, |(sizes, biases, dropout, strength), seed| {
            let (windows, heads, head_width, queries, keys) = sizes;
            let width = heads * head_width;
            let biased = biases.map_or(1, |most: usize| most.min(heads));
            let shapes: [&[usize]; 3] = [
                &[windows * queries, 3 * width],
                &[windows * keys, 2 * width],
                &[biased, queries, keys],
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
                let own = tape.attention([q, k, w], shape, None, 0.3)?;
                shape.keys = keys;
                let (k, w) = (columns(v[1], 0), columns(v[1], 1));
                let bias = biases.map(|_| v[2]);
                let other = tape.attention([q, k, w], shape, bias, 0.3)?;
                tape.add(own, other)
            })
        })
    }
}

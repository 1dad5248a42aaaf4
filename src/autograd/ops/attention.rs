//! Multi-head attention over many small windows, as one kernel.
//!
//! ```text
//! Q, K, V are columns of values with the windows' tokens as rows: q rows [windows * tq], k and v rows [windows * tk], each head h
//! has columns h * dh .. (h + 1) * dh. For each window and head:
//! S = Q K^T / sqrt(dh) [tq, tk], P = softmax(S), D = dropout(P), Y = D V.
//! dV = D^T dY, dD = dY V^T, dP = dropout(dD) with the same mask, dS = P (dP - rowsum(dP P)),
//! dQ = dS K / sqrt(dh), dK = dS^T Q / sqrt(dh).
//! ```
//!
//! Rows of S, P, D are padded to a multiple of 8 numbers, so that the loops over tk are whole vectors.

use super::softmax::softmax_backward;
use super::{argument_error, shapes_error};
use crate::autograd::kernels::{dropout_into, vectorised};
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

/// Numbers in a padded chunk of a row of scores.
const CHUNK: usize = 8;

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

/// Rows of one head's columns in a value.
#[derive(Clone, Copy)]
struct Heads<'v, T> {
    values: &'v [T],
    stride: usize,
    start: usize,
}

impl<'v, T> Heads<'v, T> {
    #[inline(always)]
    fn row(&self, row: usize, head: usize, width: usize) -> &'v [T] {
        let from = row * self.stride + self.start + head * width;
        &self.values[from..from + width]
    }
}

struct Attention<T> {
    q: HeadColumns,
    k: HeadColumns,
    v: HeadColumns,
    shape: AttentionShape,
    windows: usize,
    dropout: Option<(u64, f64)>,
    /// P, `[windows, heads, queries, padded keys]`.
    probabilities: Vec<T>,
}

/// out[i, j] = scale * a_i . b_j for one window and head, i below `queries`, j below `keys`, rows of `out` padded; the padding
/// gets 0. `transposed` is scratch for b^T, `[chunks, width, CHUNK]`.
#[inline(always)]
fn scores<T: Real>(
    out: &mut [T],
    transposed: &mut [T],
    (a, a_row): (Heads<'_, T>, usize),
    (b, b_row): (Heads<'_, T>, usize),
    head: usize,
    shape: AttentionShape,
    scale: T,
) {
    let (width, padded) = (shape.head_width(), shape.padded_keys());
    transposed.fill(T::zero());
    for j in 0..shape.keys {
        let row = b.row(b_row + j, head, width);
        let base = (j / CHUNK) * width * CHUNK + j % CHUNK;
        for (d, &x) in row.iter().enumerate() {
            transposed[base + d * CHUNK] = x;
        }
    }
    for i in 0..shape.queries {
        let row = a.row(a_row + i, head, width);
        for (chunk, out) in out[i * padded..(i + 1) * padded]
            .chunks_exact_mut(CHUNK)
            .enumerate()
        {
            let b = &transposed[chunk * width * CHUNK..(chunk + 1) * width * CHUNK];
            let mut sums = [T::zero(); CHUNK];
            for (b, &x) in b.chunks_exact(CHUNK).zip(row) {
                for (sum, &b) in sums.iter_mut().zip(b) {
                    *sum += x * b;
                }
            }
            for (out, sum) in out.iter_mut().zip(sums) {
                *out = sum * scale;
            }
        }
    }
}

/// y (+)= weight * x, row by row.
#[inline(always)]
fn add_scaled<T: Real>(y: &mut [T], weight: T, x: &[T]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y += weight * x;
    }
}

impl<T: Real> Attention<T> {
    fn heads<'s>(&self, context: &Backward<'s, T>, columns: HeadColumns) -> Heads<'s, T> {
        heads_of(
            context.values(columns.value),
            context.shape(columns.value),
            columns.start,
        )
    }

    /// Adds sum_j weight(i, j) x_j to the gradient of `of`'s row i, for each window and head.
    #[inline(always)]
    fn add_products(
        &self,
        context: &mut Backward<'_, T>,
        of: HeadColumns,
        (rows, others): (usize, usize),
        x: Heads<'_, T>,
        weight: impl Fn(usize, usize, usize) -> T,
    ) {
        let stride = context.shape(of.value).last().copied().unwrap_or(1);
        let width = self.shape.head_width();
        let Some(target) = context.target(of.value) else {
            return;
        };
        if target.fresh {
            target.data.fill(T::zero());
        }
        let data = target.data;
        let (windows, heads) = (self.windows, self.shape.heads);
        vectorised(
            #[inline(always)]
            || {
                for window in 0..windows {
                    for head in 0..heads {
                        for i in 0..rows {
                            let from =
                                (window * rows + i) * stride + of.start + head * width;
                            let row = &mut data[from..from + width];
                            for j in 0..others {
                                let x = x.row(window * others + j, head, width);
                                add_scaled(row, weight(window * heads + head, i, j), x);
                            }
                        }
                    }
                }
            },
        );
    }
}

fn heads_of<'v, T>(values: &'v [T], shape: &[usize], start: usize) -> Heads<'v, T> {
    Heads {
        values,
        stride: shape.last().copied().unwrap_or(1),
        start,
    }
}

impl<T: Real> Operation<T> for Attention<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let shape = self.shape;
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let block = shape.queries * padded;
        let (q, k, v) = (
            self.heads(context, self.q),
            self.heads(context, self.k),
            self.heads(context, self.v),
        );
        let upstream = heads_of(dy, &[shape.width], 0);
        let p = &self.probabilities;

        let mut dropped = context.take(p.len());
        match self.dropout {
            Some((key, rate)) => dropout_into(key, rate, p, &mut dropped),
            None => dropped.copy_from_slice(p),
        }
        let at = |row: usize, i: usize, j: usize| row * block + i * padded + j;
        self.add_products(
            context,
            self.v,
            (shape.keys, shape.queries),
            upstream,
            |row, j, i| dropped[at(row, i, j)],
        );

        let mut ds = dropped;
        let mut transposed = context.take(padded * width);
        vectorised(
            #[inline(always)]
            || {
                for (row, ds) in ds.chunks_exact_mut(block).enumerate() {
                    let (window, head) = (row / shape.heads, row % shape.heads);
                    let rows = (upstream, window * shape.queries);
                    let columns = (v, window * shape.keys);
                    scores(ds, &mut transposed, rows, columns, head, shape, T::one());
                }
            },
        );
        if let Some((key, rate)) = self.dropout {
            let mut dp = context.take(ds.len());
            dropout_into(key, rate, &ds, &mut dp);
            context.give(std::mem::replace(&mut ds, dp));
        }
        let scale = T::one() / T::from_f64(width as f64).sqrt();
        vectorised(
            #[inline(always)]
            || {
                for (ds, p) in ds.chunks_exact_mut(padded).zip(p.chunks_exact(padded)) {
                    softmax_backward(ds, p);
                    for d in ds {
                        *d *= scale;
                    }
                }
            },
        );
        self.add_products(
            context,
            self.q,
            (shape.queries, shape.keys),
            k,
            |row, i, j| ds[at(row, i, j)],
        );
        self.add_products(
            context,
            self.k,
            (shape.keys, shape.queries),
            q,
            |row, j, i| ds[at(row, i, j)],
        );
        context.give(ds);
        context.give(transposed);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.probabilities));
    }
}

/// Softmax over the first `keys` numbers of each padded row; the padding becomes 0.
pub(super) fn padded_softmax<T: Real>(rows: &mut [T], keys: usize, padded: usize) {
    vectorised(
        #[inline(always)]
        || {
            for row in rows.chunks_exact_mut(padded) {
                let mut max = row[0];
                for &x in &row[1..keys] {
                    // A NaN wins, to show in the result.
                    max = if x > max || x.is_nan() { x } else { max };
                }
                for x in &mut *row {
                    *x = (*x - max).exp_lane();
                }
                row[keys..].fill(T::zero());
                let inverse = T::one() / sum_with(padded, |j| row[j]);
                for x in row {
                    *x *= inverse;
                }
            }
        },
    );
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
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let block = shape.queries * padded;
        let mut probabilities = self.take(windows * shape.heads * block);
        let mut transposed = self.take(padded * width);
        let mut y = self.take(windows * shape.queries * shape.width);
        let dropout = self
            .next_dropout_key()
            .filter(|_| p > 0.0)
            .map(|key| (key, p));
        let mut dropped = match dropout {
            Some(_) => self.take(probabilities.len()),
            None => Vec::new(),
        };
        let heads = |columns: HeadColumns| {
            let value = columns.value;
            heads_of(self.values(value), self.shape(value), columns.start)
        };
        let (queries, keys, values) = (heads(q), heads(k), heads(v));
        let scale = T::one() / T::from_f64(width as f64).sqrt();
        vectorised(
            #[inline(always)]
            || {
                for (row, out) in probabilities.chunks_exact_mut(block).enumerate() {
                    let (window, head) = (row / shape.heads, row % shape.heads);
                    let a = (queries, window * shape.queries);
                    let b = (keys, window * shape.keys);
                    scores(out, &mut transposed, a, b, head, shape, scale);
                }
            },
        );
        padded_softmax(&mut probabilities, shape.keys, padded);
        let weights = match dropout {
            Some((key, p)) => {
                dropout_into(key, p, &probabilities, &mut dropped);
                &dropped
            }
            None => &probabilities,
        };
        y.fill(T::zero());
        vectorised(
            #[inline(always)]
            || {
                for (row, weights) in weights.chunks_exact(block).enumerate() {
                    let (window, head) = (row / shape.heads, row % shape.heads);
                    for i in 0..shape.queries {
                        let from = (window * shape.queries + i) * shape.width + head * width;
                        let y = &mut y[from..from + width];
                        for j in 0..shape.keys {
                            let v = values.row(window * shape.keys + j, head, width);
                            add_scaled(y, weights[i * padded + j], v);
                        }
                    }
                }
            },
        );
        self.give(transposed);
        self.give(dropped);
        if !self.is_recording() {
            self.give(std::mem::take(&mut probabilities));
        }
        let rows = windows * shape.queries;
        let inputs = [q.value, k.value, v.value];
        Ok(
            self.record("attention", &inputs, &[rows, shape.width], y, || Attention {
                q,
                k,
                v,
                shape,
                windows,
                dropout,
                probabilities,
            }),
        )
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
    use crate::autograd::check::property::{Case, case};

    /// Self-attention with Q, K, V in one value, and attention between two values; with and without dropout; more keys than
    /// a padded chunk.
    pub fn cases() -> BoxedStrategy<Case> {
        (0usize..3, 1usize..3, 1usize..3, 1usize..4, 1usize..11, any::<bool>(), any::<u64>())
            .prop_map(|(windows, heads, head_width, queries, keys, dropout, seed)| {
                let width = heads * head_width;
                let shapes: [&[usize]; 2] =
                    [&[windows * queries, 3 * width], &[windows * keys, 2 * width]];
                case(&shapes, seed, 0.0, move |tape, v| {
                    tape.set_dropout(dropout.then_some(seed));
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
                    let (q, k, w) = (columns(v[0], 0), columns(v[0], 1), columns(v[0], 2));
                    let own = tape.attention(q, k, w, shape, 0.3)?;
                    shape.keys = keys;
                    let (k, w) = (columns(v[1], 0), columns(v[1], 1));
                    let other = tape.attention(q, k, w, shape, 0.3)?;
                    tape.add(own, other)
                })
            })
            .boxed()
    }
}

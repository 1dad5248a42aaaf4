//! Multi-head attention of one query a window, with the keys' and values' projections inside.
//!
//! With a single query the projections of the keys and values need not be made:
//! q . (W_k x) = (W_k^T q) . x and sum_j p_j W_v x_j = W_v sum_j p_j x_j. (The keys' bias adds the
//! same number to every score of a window, which the softmax ignores.)
//!
//! ```text
//! q [B, d] (projected), x [B * n, d'], for each head W_k, W_v [dh, d'], b_v [d]:
//! u = q_h W_k [d'], s_j = u . x_j / sqrt(dh), p = softmax(s), m = dropout(p), z = sum_j m_j x_j,
//! y_h = W_v z + b_v,h sum_j m_j.
//! dz = W_v^T dy_h, dm_j = dz . x_j + b_v,h . dy_h, ds by dropout and softmax,
//! du = sum_j ds_j x_j / sqrt(dh), dx_j = m_j dz + ds_j u / sqrt(dh), dq_h = W_k du,
//! dW_k = q_h^T du, dW_v = dy_h^T z, db_v,h = sum_B dy_h sum_j m_j.
//! ```

use std::ops::Range;

use super::attention::AttentionShape;
use super::attention_core::{Sums, scores, softmax_gradient};
use super::{argument_error, shapes_error};
use crate::autograd::kernels::{Mat, MatMut, WindowRows, dropped_into, vectorised, window_softmax};
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

const NAME: &str = "query_attention";

/// The projections of keys and values, one weight a head.
#[derive(Debug, Clone)]
pub struct QueryAttentionWeights {
    /// W_k of each head, `[dh, d']`.
    pub keys: Vec<Var>,
    /// W_v of each head, `[dh, d']`.
    pub values: Vec<Var>,
    /// b_v of all heads, `[d]`.
    pub value_bias: Var,
}

#[derive(Debug, Clone, Copy)]
struct Sizes {
    batch: usize,
    tokens: usize,
    heads: usize,
    head_width: usize,
    /// Numbers of a token, d'.
    width: usize,
}

impl Sizes {
    /// The heads of a query are so many queries to the same tokens, as they are.
    fn shape(&self) -> AttentionShape {
        AttentionShape {
            heads: 1,
            width: self.width,
            queries: self.heads,
            keys: self.tokens,
        }
    }

    /// Columns of all heads of a query, d.
    fn query_width(&self) -> usize {
        self.heads * self.head_width
    }

    fn scale<T: Real>(&self) -> T {
        T::one() / T::from_f64(self.head_width as f64).sqrt()
    }

    /// Columns of a head in queries and outputs.
    fn head(&self, h: usize) -> Range<usize> {
        h * self.head_width..(h + 1) * self.head_width
    }

    /// Columns of a head in u and z.
    fn tokens_of_head(&self, h: usize) -> Range<usize> {
        h * self.width..(h + 1) * self.width
    }

    /// Tokens, or what is made of them for each head, as rows.
    fn rows<'v, T>(&self, values: &'v [T]) -> WindowRows<'v, T> {
        WindowRows {
            values,
            start: 0,
            stride: self.width,
        }
    }
}

struct QueryAttention<T> {
    q: Var,
    x: Var,
    weights: QueryAttentionWeights,
    sizes: Sizes,
    dropout: Option<(u64, f64)>,
    /// u of each head, `[B, heads, d']`.
    u: Vec<T>,
    /// p, `[B, heads, padded tokens]`.
    p: Vec<T>,
    /// m, likewise.
    m: Vec<T>,
    /// z of each head, `[B, heads, d']`.
    z: Vec<T>,
}

impl<T: Real> Operation<T> for QueryAttention<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (sizes, shape, known) = (self.sizes, self.sizes.shape(), context.known());
        let Sizes {
            batch,
            tokens,
            heads,
            head_width: dh,
            width,
        } = sizes;
        let (all, padded) = (sizes.query_width(), shape.padded_keys());
        let (x, q) = (context.values(self.x), context.values(self.q));
        let rows = sizes.rows(x);

        // dz, and the gradients of W_v and b_v.
        let mut dz = context.take(batch * heads * width);
        for (h, &weight) in self.weights.values.iter().enumerate() {
            let dy_h = Mat::new(dy, batch, all).columns(sizes.head(h));
            let z_h = Mat::new(&self.z, batch, heads * width).columns(sizes.tokens_of_head(h));
            context.weight_gradient(weight, dy_h, z_h);
            let dz = MatMut::new(&mut dz, batch, heads * width);
            known.product(dy_h, weight, dz.columns(sizes.tokens_of_head(h)), false);
        }
        let bias = context.values(self.weights.value_bias);
        if let Some(target) = context.target(self.weights.value_bias) {
            let db = target.so_far();
            for (row, dy) in dy.chunks_exact(dh).enumerate() {
                let kept = &self.m[row * padded..(row + 1) * padded];
                let sum: T = kept.iter().copied().sum();
                let db = &mut db[sizes.head(row % heads)];
                db.iter_mut().zip(dy).for_each(|(db, &dy)| *db += dy * sum);
            }
        }

        // ds in place of dm.
        let mut scratch = context.take(shape.scratch_len());
        let mut ds = context.take(batch * heads * padded);
        let pair = (sizes.rows(&dz), rows);
        scores((&mut ds, 0), pair, shape, T::one(), &mut scratch);
        vectorised(
            #[inline(always)]
            || {
                let rows = ds.chunks_exact_mut(padded).zip(dy.chunks_exact(dh));
                for (row, (ds, dy)) in rows.enumerate() {
                    let bias = &bias[row % heads * dh..][..dh];
                    let shift = sum_with(dh, |d| bias[d] * dy[d]);
                    ds[..tokens].iter_mut().for_each(|d| *d += shift);
                }
            },
        );
        let scale = sizes.scale();
        softmax_gradient((&mut ds, 0), self.dropout, &self.p, tokens, scale);
        let mut du = context.take(batch * heads * width);
        let sums = |weights, for_keys, rows| Sums {
            weights,
            first: 0,
            for_keys,
            rows,
        };
        sums(&ds, false, rows).put(&mut du, (0, width), shape, false, &mut scratch);
        if let Some(target) = context.target(self.x) {
            let (data, place) = (target.data, (0, width));
            let (of_values, of_keys) = (sizes.rows(&dz), sizes.rows(&self.u));
            sums(&self.m, true, of_values).put(data, place, shape, !target.fresh, &mut scratch);
            sums(&ds, true, of_keys).put(data, place, shape, true, &mut scratch);
        }

        for (h, &weight) in self.weights.keys.iter().enumerate() {
            let q_h = Mat::new(q, batch, all).columns(sizes.head(h));
            let du_h = Mat::new(&du, batch, heads * width).columns(sizes.tokens_of_head(h));
            context.weight_gradient(weight, q_h, du_h);
            if let Some(target) = context.target(self.q) {
                let dq = MatMut::new(target.so_far(), batch, all);
                known.product_transposed(du_h, weight, dq.columns(sizes.head(h)), true);
            }
        }
        for buffer in [dz, ds, du, scratch] {
            context.give(buffer);
        }
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        for buffer in [&mut self.u, &mut self.p, &mut self.m, &mut self.z] {
            workspace.give(std::mem::take(buffer));
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// Attention of one query a window, `q [B, d]`, to its `tokens` tokens in `x [B * tokens, d']`,
    /// as `[B, d]`; dropout with probability `p` on the attention weights. Equal to projecting keys
    /// and values and then [`Tape::attention`].
    ///
    /// # Errors
    /// Shapes that do not fit, a probability that is none.
    pub fn query_attention(
        &mut self,
        q: Var,
        x: Var,
        weights: QueryAttentionWeights,
        tokens: usize,
        p: f64,
    ) -> Result<Var, AutogradError> {
        let mut inputs = vec![q, x, weights.value_bias];
        inputs.extend_from_slice(&weights.keys);
        inputs.extend_from_slice(&weights.values);
        self.own(NAME, &inputs)?;
        let sizes = self.query_attention_sizes(q, x, &weights, tokens)?;
        let dropout = self.next_draws(NAME, p)?;
        let shape = sizes.shape();
        let Sizes {
            batch,
            heads,
            head_width: dh,
            width,
            ..
        } = sizes;
        let (all, padded) = (sizes.query_width(), shape.padded_keys());
        let mut u = self.take(batch * heads * width);
        let mut z = self.take(batch * heads * width);
        let mut attention = self.take(batch * heads * padded);
        let mut m = self.take(batch * heads * padded);
        let mut y = self.take(batch * all);
        let mut scratch = self.take(shape.scratch_len());
        let (known, rows) = (self.known(), sizes.rows(self.values(x)));
        for (h, &weight) in weights.keys.iter().enumerate() {
            let q_h = Mat::new(self.values(q), batch, all).columns(sizes.head(h));
            let u = MatMut::new(&mut u, batch, heads * width);
            known.product(q_h, weight, u.columns(sizes.tokens_of_head(h)), false);
        }
        let pair = (sizes.rows(&u), rows);
        scores(
            (&mut attention, 0),
            pair,
            shape,
            sizes.scale(),
            &mut scratch,
        );
        vectorised(
            #[inline(always)]
            || window_softmax(&mut attention, tokens),
        );
        dropped_into(dropout, &attention, &mut m);
        let sums = Sums {
            weights: &m,
            first: 0,
            for_keys: false,
            rows,
        };
        sums.put(&mut z, (0, width), shape, false, &mut scratch);
        let bias = self.values(weights.value_bias);
        for (row, y) in y.chunks_exact_mut(dh).enumerate() {
            let sum: T = m[row * padded..(row + 1) * padded].iter().copied().sum();
            let bias = &bias[sizes.head(row % heads)];
            y.iter_mut().zip(bias).for_each(|(y, &b)| *y = b * sum);
        }
        for (h, &weight) in weights.values.iter().enumerate() {
            let z_h = Mat::new(&z, batch, heads * width).columns(sizes.tokens_of_head(h));
            let y = MatMut::new(&mut y, batch, all);
            known.product_transposed(z_h, weight, y.columns(sizes.head(h)), true);
        }
        self.give(scratch);
        if !self.is_recording() {
            for buffer in [&mut u, &mut attention, &mut m, &mut z] {
                self.give(std::mem::take(buffer));
            }
        }
        let operation = || QueryAttention {
            q,
            x,
            weights,
            sizes,
            dropout,
            u,
            p: attention,
            m,
            z,
        };
        Ok(self.put(NAME, &inputs, &[batch, all], y, operation))
    }

    fn query_attention_sizes(
        &self,
        q: Var,
        x: Var,
        weights: &QueryAttentionWeights,
        tokens: usize,
    ) -> Result<Sizes, AutogradError> {
        let (left, right) = (self.shape(q), self.shape(x));
        let (batch, all, width) = match (left, right) {
            (&[batch, all], &[rows, width])
                if tokens > 0 && width > 0 && batch.checked_mul(tokens) == Some(rows) =>
            {
                (batch, all, width)
            }
            _ => {
                let expected = "q [B, d] and x [B * n, d']";
                return Err(shapes_error(NAME, left, right, expected));
            }
        };
        let heads = weights.keys.len();
        if heads == 0 || weights.values.len() != heads || all == 0 || all % heads != 0 {
            let argument = format!("{heads} heads");
            let expected = "as many W_k as W_v, a number that divides the queries' width";
            return Err(argument_error(NAME, self.shape(q), argument, expected));
        }
        let head_width = all / heads;
        for &weight in weights.keys.iter().chain(&weights.values) {
            if self.shape(weight) != [head_width, width] {
                let (left, right) = (self.shape(x), self.shape(weight));
                let expected = "x [B * n, d'] and weights [d / heads, d']";
                return Err(shapes_error(NAME, left, right, expected));
            }
        }
        if self.shape(weights.value_bias) != [all] {
            let (left, right) = (self.shape(q), self.shape(weights.value_bias));
            return Err(shapes_error(NAME, left, right, "q [B, d] and bias [d]"));
        }
        Ok(Sizes {
            batch,
            // Without a window none is long, whatever is asked for.
            tokens: if batch == 0 { 1 } else { tokens },
            heads,
            head_width,
            width,
        })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use super::QueryAttentionWeights;
    use crate::autograd::check::property::{Cases, case, drawn, strength};

    /// Two heads that share no weight, with and without dropout; small scores and large.
    pub fn cases() -> Cases {
        let sizes = (0usize..3, 1usize..10, 1usize..3, 1usize..4);
        let inputs = (sizes, any::<bool>(), strength());
        drawn(inputs, |(sizes, dropout, strength), seed| {
            let (batch, tokens, dh, width) = sizes;
            let (q, x): (&[usize], &[usize]) = (&[batch, 2 * dh], &[batch * tokens, width]);
            let (w, bias): (&[usize], &[usize]) = (&[dh, width], &[2 * dh]);
            let shapes = [q, x, w, w, w, w, bias];
            case(&shapes, seed, 0.0, move |tape, v| {
                tape.set_dropout(dropout.then_some(seed));
                let weights = QueryAttentionWeights {
                    keys: vec![v[2], v[3]],
                    values: vec![v[4], v[5]],
                    value_bias: v[6],
                };
                let queries = tape.affine(v[0], strength, 0.0);
                tape.query_attention(queries, v[1], weights, tokens, 0.3)
            })
        })
    }
}

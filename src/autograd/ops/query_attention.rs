//! Multi-head attention of one query a window, with the keys' and values' projections inside.
//!
//! ```text
//! With a single query the projections of the keys and values need not be made: q . (W_k x) = (W_k^T q) . x and
//! sum_j p_j W_v x_j = W_v sum_j p_j x_j. q [B, d] (projected), x [B * n, d'], for each head W_k, W_v [dh, d'], b_v [d]:
//! u = q_h W_k [d'], s_j = u . x_j / sqrt(dh), p = softmax(s), m = dropout(p), z = sum_j m_j x_j,
//! y_h = W_v z + b_v,h sum_j m_j.
//! (The keys' bias adds the same number to every score of a window, which the softmax ignores.)
//! dz = W_v^T dy_h, dm_j = dz . x_j + b_v,h . dy_h, ds by dropout and softmax, du = sum_j ds_j x_j / sqrt(dh),
//! dx_j = m_j dz + ds_j u / sqrt(dh), dq_h = W_k du, dW_k = q_h^T du, dW_v = dy_h^T z, db_v,h = sum_B dy_h sum_j m_j.
//! ```

use super::{argument_error, shapes_error};
use crate::autograd::kernels::{
    CHUNK, Mat, MatMut, WindowRows, WindowWeights, dropout_into, product, product_bt,
    product_packed, scratch_len, vectorised, window_scores, window_softmax,
    window_softmax_backward, window_sums,
};
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

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
    fn padded(&self) -> usize {
        self.tokens.next_multiple_of(CHUNK)
    }

    /// Columns of all heads of a query, d.
    fn query_width(&self) -> usize {
        self.heads * self.head_width
    }

    fn scale<T: Real>(&self) -> T {
        T::one() / T::from_f64(self.head_width as f64).sqrt()
    }

    /// Length of the scratch of a window's products.
    fn scratch_len(&self) -> usize {
        scratch_len(self.tokens.max(self.heads), self.width)
    }
}

/// `values [rows, width]` as rows of a window.
#[inline(always)]
fn rows<T>(values: &[T], width: usize) -> WindowRows<'_, T> {
    WindowRows {
        values,
        start: 0,
        stride: width,
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

/// The columns of one head in `values [rows, stride]`, for reading.
fn columns<T: Real>(
    values: &[T],
    rows: usize,
    stride: usize,
    start: usize,
    n: usize,
) -> Mat<'_, T> {
    if rows == 0 {
        return Mat::new(&[], 0, n);
    }
    Mat::strided(&values[start..], rows, n, stride)
}

fn columns_mut<T: Real>(
    values: &mut [T],
    rows: usize,
    stride: usize,
    start: usize,
    n: usize,
) -> MatMut<'_, T> {
    if rows == 0 {
        return MatMut::new(&mut [], 0, n);
    }
    MatMut::strided(&mut values[start..], rows, n, stride)
}

/// out[b, h, j] = scale * a[b, h] . x[b, j]; the padding gets 0.
fn scores<T: Real>(out: &mut [T], a: &[T], x: &[T], sizes: Sizes, scale: T, scratch: &mut [T]) {
    vectorised(
        #[inline(always)]
        || {
            for (window, out) in out
                .chunks_exact_mut(sizes.heads * sizes.padded())
                .enumerate()
            {
                let a = rows(a, sizes.width).from(window * sizes.heads, 0);
                let x = rows(x, sizes.width).from(window * sizes.tokens, 0);
                window_scores(out, a, (x, sizes.tokens), sizes.width, scale, scratch);
            }
        },
    );
}

/// out[b, h] = sum_j weights[b, h, j] x[b, j].
fn weighted_sums<T: Real>(out: &mut [T], weights: &[T], x: &[T], sizes: Sizes, scratch: &mut [T]) {
    let (width, padded) = (sizes.width, sizes.padded());
    vectorised(
        #[inline(always)]
        || {
            for (window, out) in out.chunks_exact_mut(sizes.heads * width).enumerate() {
                let weights = WindowWeights {
                    values: &weights[window * sizes.heads * padded..],
                    result: padded,
                    row: 1,
                };
                let x = rows(x, width).from(window * sizes.tokens, 0);
                let out = (out, width, sizes.heads);
                window_sums(out, weights, (x, sizes.tokens), width, false, scratch);
            }
        },
    );
}

impl<T: Real> Operation<T> for QueryAttention<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let sizes = self.sizes;
        let Sizes {
            batch,
            tokens,
            heads,
            head_width: dh,
            width,
        } = sizes;
        let (all, padded) = (sizes.query_width(), sizes.padded());
        let x = context.values(self.x);
        let q = context.values(self.q);

        // dz, and the gradients of W_v and b_v.
        let mut dz = context.take(batch * heads * width);
        for (h, &weight) in self.weights.values.iter().enumerate() {
            let dy_h = columns(dy, batch, all, h * dh, dh);
            let z_h = columns(&self.z, batch, heads * width, h * width, width);
            context.weight_gradient(weight, dy_h, z_h);
            let dz_h = columns_mut(&mut dz, batch, heads * width, h * width, width);
            match context.packed(weight) {
                Some(packed) => product_packed(dy_h, packed, dz_h, false),
                None => {
                    let weight = Mat::new(context.values(weight), dh, width);
                    product(dy_h, weight, dz_h, false);
                }
            }
        }
        let bias = context.values(self.weights.value_bias);
        if let Some(target) = context.target(self.weights.value_bias) {
            if target.fresh {
                target.data.fill(T::zero());
            }
            for (row, dy) in dy.chunks_exact(dh).enumerate() {
                let sum: T = self.m[row * padded..(row + 1) * padded]
                    .iter()
                    .copied()
                    .sum();
                let head = row % heads;
                let db = &mut target.data[head * dh..(head + 1) * dh];
                db.iter_mut().zip(dy).for_each(|(db, &dy)| *db += dy * sum);
            }
        }

        // ds in place of dm.
        let mut scratch = context.take(sizes.scratch_len());
        let mut ds = context.take(batch * heads * padded);
        scores(&mut ds, &dz, x, sizes, T::one(), &mut scratch);
        vectorised(
            #[inline(always)]
            || {
                for (row, (ds, dy)) in ds
                    .chunks_exact_mut(padded)
                    .zip(dy.chunks_exact(dh))
                    .enumerate()
                {
                    let bias = &bias[row % heads * dh..][..dh];
                    let shift = sum_with(dh, |d| bias[d] * dy[d]);
                    ds[..tokens].iter_mut().for_each(|d| *d += shift);
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
            || window_softmax_backward(&mut ds, &self.p, tokens, sizes.scale()),
        );
        let mut du = context.take(batch * heads * width);
        weighted_sums(&mut du, &ds, x, sizes, &mut scratch);

        if let Some(target) = context.target(self.x) {
            let (fresh, data) = (target.fresh, target.data);
            vectorised(
                #[inline(always)]
                || {
                    for (window, dx) in data.chunks_exact_mut(tokens * width).enumerate() {
                        let parts = [(&self.m, &dz), (&ds, &self.u)];
                        for (k, (weights, rows_of)) in parts.into_iter().enumerate() {
                            let weights = WindowWeights {
                                values: &weights[window * heads * padded..],
                                result: 1,
                                row: padded,
                            };
                            let a = rows(rows_of, width).from(window * heads, 0);
                            let out = (&mut *dx, width, tokens);
                            let accumulate = k > 0 || !fresh;
                            window_sums(out, weights, (a, heads), width, accumulate, &mut scratch);
                        }
                    }
                },
            );
        }

        for (h, &weight) in self.weights.keys.iter().enumerate() {
            let q_h = columns(q, batch, all, h * dh, dh);
            let du_h = columns(&du, batch, heads * width, h * width, width);
            context.weight_gradient(weight, q_h, du_h);
            let packed = context.packed_transposed(weight);
            let values = context.values(weight);
            if let Some(target) = context.target(self.q) {
                if target.fresh && h == 0 {
                    target.data.fill(T::zero());
                }
                let dq_h = columns_mut(target.data, batch, all, h * dh, dh);
                match packed {
                    Some(packed) => product_packed(du_h, packed, dq_h, true),
                    None => product_bt(du_h, Mat::new(values, dh, width), dq_h, true),
                }
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
    /// Attention of one query a window, `q [B, d]`, to its `tokens` tokens in `x [B * tokens, d']`, as `[B, d]`; dropout with
    /// probability `p` on the attention weights. Equal to projecting keys and values and then [`Tape::attention`].
    ///
    /// # Errors
    /// Shapes that do not fit.
    pub fn query_attention(
        &mut self,
        q: Var,
        x: Var,
        weights: QueryAttentionWeights,
        tokens: usize,
        p: f64,
    ) -> Result<Var, AutogradError> {
        let sizes = self.query_attention_sizes(q, x, &weights, tokens)?;
        let Sizes {
            batch,
            heads,
            head_width: dh,
            width,
            ..
        } = sizes;
        let (all, padded) = (sizes.query_width(), sizes.padded());
        let mut u = self.take(batch * heads * width);
        let mut z = self.take(batch * heads * width);
        let mut attention = self.take(batch * heads * padded);
        let mut m = self.take(batch * heads * padded);
        let mut y = self.take(batch * all);
        let mut scratch = self.take(sizes.scratch_len());
        let dropout = self
            .next_dropout_key()
            .filter(|_| p > 0.0)
            .map(|key| (key, p));
        let (queries, tokens_x) = (self.values(q), self.values(x));
        for (h, &weight) in weights.keys.iter().enumerate() {
            let q_h = columns(queries, batch, all, h * dh, dh);
            let u_h = columns_mut(&mut u, batch, heads * width, h * width, width);
            match self.packed(weight) {
                Some(packed) => product_packed(q_h, packed, u_h, false),
                None => product(q_h, Mat::new(self.values(weight), dh, width), u_h, false),
            }
        }
        scores(
            &mut attention,
            &u,
            tokens_x,
            sizes,
            sizes.scale(),
            &mut scratch,
        );
        vectorised(
            #[inline(always)]
            || window_softmax(&mut attention, tokens),
        );
        match dropout {
            Some((key, rate)) => dropout_into(key, rate, &attention, &mut m),
            None => m.copy_from_slice(&attention),
        }
        weighted_sums(&mut z, &m, tokens_x, sizes, &mut scratch);
        let bias = self.values(weights.value_bias);
        for (row, y) in y.chunks_exact_mut(dh).enumerate() {
            let sum: T = m[row * padded..(row + 1) * padded].iter().copied().sum();
            let bias = &bias[row % heads * dh..][..dh];
            y.iter_mut().zip(bias).for_each(|(y, &b)| *y = b * sum);
        }
        for (h, &weight) in weights.values.iter().enumerate() {
            let z_h = columns(&z, batch, heads * width, h * width, width);
            let y_h = columns_mut(&mut y, batch, all, h * dh, dh);
            match self.packed_transposed(weight) {
                Some(packed) => product_packed(z_h, packed, y_h, true),
                None => product_bt(z_h, Mat::new(self.values(weight), dh, width), y_h, true),
            }
        }
        self.give(scratch);
        let mut inputs = vec![q, x, weights.value_bias];
        inputs.extend_from_slice(&weights.keys);
        inputs.extend_from_slice(&weights.values);
        if !self.is_recording() {
            for buffer in [&mut u, &mut attention, &mut m, &mut z] {
                self.give(std::mem::take(buffer));
            }
        }
        Ok(
            self.record("query_attention", &inputs, &[batch, all], y, || {
                QueryAttention {
                    q,
                    x,
                    weights,
                    sizes,
                    dropout,
                    u,
                    p: attention,
                    m,
                    z,
                }
            }),
        )
    }

    fn query_attention_sizes(
        &self,
        q: Var,
        x: Var,
        weights: &QueryAttentionWeights,
        tokens: usize,
    ) -> Result<Sizes, AutogradError> {
        const NAME: &str = "query_attention";
        let (&[batch, all], &[rows, width]) = (self.shape(q), self.shape(x)) else {
            let (left, right) = (self.shape(q), self.shape(x));
            return Err(shapes_error(
                NAME,
                left,
                right,
                "q [B, d] and x [B * n, d']",
            ));
        };
        if tokens == 0 || rows != batch * tokens || width == 0 {
            let (left, right) = (self.shape(q), self.shape(x));
            return Err(shapes_error(
                NAME,
                left,
                right,
                "q [B, d] and x [B * n, d']",
            ));
        }
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
            tokens,
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
    use crate::autograd::check::property::{Case, case, strength};

    /// Two heads that share no weight, with and without dropout; small scores and large.
    pub fn cases() -> BoxedStrategy<Case> {
        (
            0usize..3,
            1usize..10,
            1usize..3,
            1usize..4,
            any::<bool>(),
            strength(),
            any::<u64>(),
        )
            .prop_map(|(batch, tokens, dh, width, dropout, strength, seed)| {
                let weight: &[usize] = &[dh, width];
                let shapes: [&[usize]; 7] = [
                    &[batch, 2 * dh],
                    &[batch * tokens, width],
                    weight,
                    weight,
                    weight,
                    weight,
                    &[2 * dh],
                ];
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
            .boxed()
    }
}

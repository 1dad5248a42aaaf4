//! What the attentions share: scores in windows and heads, sums of rows weighted with them, and the
//! way back through their softmax.

use super::attention::AttentionShape;
use crate::autograd::kernels::{
    WindowRows, WindowWeights, dropout_into, vectorised, window_scores, window_softmax_backward,
    window_sums,
};
use crate::autograd::{Backward, Real};

/// out `[windows, heads, queries, padded keys]` = scale a . b, for rows `a` of the queries and `b`
/// of the keys.
pub(super) fn scores<T: Real>(
    out: &mut [T],
    (a, b): (WindowRows<'_, T>, WindowRows<'_, T>),
    shape: AttentionShape,
    scale: T,
    scratch: &mut [T],
) {
    let width = shape.head_width();
    vectorised(
        #[inline(always)]
        || {
            for (k, out) in out.chunks_exact_mut(shape.block()).enumerate() {
                let (window, column) = (k / shape.heads, k % shape.heads * width);
                let a = a.from(window * shape.queries, column);
                let b = b.from(window * shape.keys, column);
                window_scores(out, a, (b, shape.keys), width, scale, scratch);
            }
        },
    );
}

/// Sums of rows: of the keys' rows for each query or, the other way round, of the queries' rows for
/// each key.
pub(super) struct Sums<'w, T> {
    /// `[windows, heads, queries, padded keys]`
    pub(super) weights: &'w [T],
    pub(super) for_keys: bool,
    pub(super) rows: WindowRows<'w, T>,
}

impl<T: Real> Sums<'_, T> {
    /// Writes or adds the sums to rows that begin `stride` apart, from `start` on.
    pub(super) fn put(
        &self,
        out: &mut [T],
        (start, stride): (usize, usize),
        shape: AttentionShape,
        accumulate: bool,
        scratch: &mut [T],
    ) {
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let (results, others) = if self.for_keys {
            (shape.keys, shape.queries)
        } else {
            (shape.queries, shape.keys)
        };
        vectorised(
            #[inline(always)]
            || {
                for (k, values) in self.weights.chunks_exact(shape.block()).enumerate() {
                    let (window, column) = (k / shape.heads, k % shape.heads * width);
                    let from = start + window * results * stride + column;
                    let x = self.rows.from(window * others, column);
                    let weights = WindowWeights {
                        values,
                        padded,
                        columns: self.for_keys,
                    };
                    let out = (&mut out[from..], stride, results);
                    window_sums(out, weights, (x, others), width, accumulate, scratch);
                }
            },
        );
    }
}

/// scale dS in place of dD, for P = softmax(S) and D = dropout(P).
pub(super) fn softmax_gradient<T: Real>(
    context: &mut Backward<'_, T>,
    ds: &mut Vec<T>,
    dropout: Option<(u64, f64)>,
    p: &[T],
    keys: usize,
    scale: T,
) {
    if let Some((key, rate)) = dropout {
        let mut dp = context.take(ds.len());
        dropout_into(key, rate, ds, &mut dp);
        context.give(std::mem::replace(ds, dp));
    }
    vectorised(
        #[inline(always)]
        || window_softmax_backward(ds, p, keys, scale),
    );
}

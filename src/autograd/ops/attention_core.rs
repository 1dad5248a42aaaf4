//! What the attentions share: scores in windows and heads, sums of rows weighted with them, and the
//! way back through their softmax.

use super::attention::AttentionShape;
use crate::autograd::Real;
use crate::autograd::kernels::{
    Mat, MatMut, WindowRows, WindowWeights, drop_in_place, product, product_at, product_bt,
    vectorised, window_scores, window_softmax_backward, window_sums,
};

/// From so many keys on a general product is faster than the sums of small windows.
const LONG: usize = 64;

/// out `[pairs, queries, padded keys]` = scale a . b, for rows `a` of the queries and `b` of the
/// keys. The pairs of a window and a head are numbered heads within windows; `out` begins with pair
/// `first`.
pub(super) fn scores<T: Real>(
    (out, first): (&mut [T], usize),
    (a, b): (WindowRows<'_, T>, WindowRows<'_, T>),
    shape: AttentionShape,
    scale: T,
    scratch: &mut [T],
) {
    let width = shape.head_width();
    if shape.keys >= LONG {
        return long_scores((out, first), (a, b), shape, scale);
    }
    vectorised(
        #[inline(always)]
        || {
            for (k, out) in (first..).zip(out.chunks_exact_mut(shape.block())) {
                let (window, column) = (k / shape.heads, k % shape.heads * width);
                let a = a.from(window * shape.queries, column);
                let b = b.from(window * shape.keys, column);
                window_scores(out, a, (b, shape.keys), width, scale, scratch);
            }
        },
    );
}

/// [`scores`] of windows of many keys.
fn long_scores<T: Real>(
    (out, first): (&mut [T], usize),
    (a, b): (WindowRows<'_, T>, WindowRows<'_, T>),
    shape: AttentionShape,
    scale: T,
) {
    let (width, padded) = (shape.head_width(), shape.padded_keys());
    for (k, out) in (first..).zip(out.chunks_exact_mut(shape.block())) {
        let (window, column) = (k / shape.heads, k % shape.heads * width);
        let a = a
            .from(window * shape.queries, column)
            .matrix(shape.queries, width);
        let b = b
            .from(window * shape.keys, column)
            .matrix(shape.keys, width);
        product_bt(
            a,
            b,
            MatMut::strided(out, shape.queries, shape.keys, padded),
            false,
        );
        for row in out.chunks_exact_mut(padded) {
            let (row, padding) = row.split_at_mut(shape.keys);
            row.iter_mut().for_each(|score| *score *= scale);
            padding.fill(T::zero());
        }
    }
}

/// Sums of rows: of the keys' rows for each query or, the other way round, of the queries' rows for
/// each key.
pub(super) struct Sums<'w, T> {
    /// `[pairs, queries, padded keys]`
    pub(super) weights: &'w [T],
    /// The pair that they begin with, see [`scores`].
    pub(super) first: usize,
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
        if shape.keys >= LONG {
            return self.put_long(out, (start, stride), shape, accumulate);
        }
        vectorised(
            #[inline(always)]
            || {
                for (k, values) in (self.first..).zip(self.weights.chunks_exact(shape.block())) {
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

    /// [`Sums::put`] for windows of many keys.
    fn put_long(
        &self,
        out: &mut [T],
        (start, stride): (usize, usize),
        shape: AttentionShape,
        accumulate: bool,
    ) {
        let (width, padded) = (shape.head_width(), shape.padded_keys());
        let (queries, keys) = (shape.queries, shape.keys);
        for (k, values) in (self.first..).zip(self.weights.chunks_exact(shape.block())) {
            let (window, column) = (k / shape.heads, k % shape.heads * width);
            let weights = Mat::strided(values, queries, keys, padded);
            let to = |results| start + window * results * stride + column;
            if self.for_keys {
                let x = self
                    .rows
                    .from(window * queries, column)
                    .matrix(queries, width);
                let out = MatMut::strided(&mut out[to(keys)..], keys, width, stride);
                product_at(weights, x, out, accumulate);
            } else {
                let x = self.rows.from(window * keys, column).matrix(keys, width);
                let out = MatMut::strided(&mut out[to(queries)..], queries, width, stride);
                product(weights, x, out, accumulate);
            }
        }
    }
}

/// scale dS in place of dD, for P = softmax(S) and D = dropout(P); `ds` begins with number `first`
/// of the mask.
pub(super) fn softmax_gradient<T: Real>(
    (ds, first): (&mut [T], usize),
    dropout: Option<(u64, f64)>,
    p: &[T],
    keys: usize,
    scale: T,
) {
    drop_in_place(dropout, first, ds);
    vectorised(
        #[inline(always)]
        || window_softmax_backward(ds, p, keys, scale),
    );
}

//! A bias of attention scores that is looked up by what the two tokens are to each other, such as
//! their distance (Raffel et al. 2020, section 2.1).
//!
//! ```text
//! weight [buckets, heads], buckets [queries, keys] -> y [heads, queries, keys],
//! y[h, i, j] = weight[bucket_ij, h]; dweight[b, h] = sum of dY[h, i, j] over all ij in bucket b.
//! ```

use std::sync::Arc;

use super::argument_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct RelativeBias {
    weight: Var,
    heads: usize,
    buckets: Arc<[usize]>,
}

impl<T: Real> Operation<T> for RelativeBias {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let Some(target) = context.target(self.weight) else {
            return;
        };
        let dweight = target.so_far();
        if self.buckets.is_empty() {
            return;
        }
        for (head, dy) in dy.chunks_exact(self.buckets.len()).enumerate() {
            for (&bucket, &dy) in self.buckets.iter().zip(dy) {
                dweight[bucket * self.heads + head] += dy;
            }
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// `weight [buckets, heads]` at the bucket of each query and key (`queries` rows of as many
    /// keys), as `[heads, queries, keys]`.
    ///
    /// # Errors
    /// A weight of another shape, a bucket that it does not have, rows that are not whole.
    pub fn relative_bias(
        &mut self,
        weight: Var,
        buckets: &Arc<[usize]>,
        queries: usize,
    ) -> Result<Var, AutogradError> {
        self.own("relative_bias", &[weight])?;
        let shape = self.shape(weight).to_vec();
        let &[count, heads] = shape.as_slice() else {
            let argument = format!("{} axes", shape.len());
            let expected = "a weight [buckets, heads]";
            return Err(argument_error("relative_bias", &shape, argument, expected));
        };
        let whole = queries > 0 && buckets.len().is_multiple_of(queries);
        if !whole || buckets.iter().any(|&bucket| bucket >= count) {
            let argument = format!("{} buckets in {queries} rows", buckets.len());
            let expected = "whole rows of buckets that the weight has";
            return Err(argument_error("relative_bias", &shape, argument, expected));
        }
        let mut y = self.take(heads * buckets.len());
        if !buckets.is_empty() {
            let values = self.values(weight);
            for (head, y) in y.chunks_exact_mut(buckets.len()).enumerate() {
                for (y, &bucket) in y.iter_mut().zip(buckets.iter()) {
                    *y = values[bucket * heads + head];
                }
            }
        }
        let output = [heads, queries, buckets.len() / queries];
        Ok(
            self.put("relative_bias", &[weight], &output, y, || RelativeBias {
                weight,
                heads,
                buckets: buckets.clone(),
            }),
        )
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use std::sync::Arc;

    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        let inputs = (1usize..5, 0usize..4, 1usize..4, 0usize..5).prop_flat_map(
            |(count, heads, queries, keys)| {
                let buckets = prop::collection::vec(0..count, queries * keys);
                (Just((count, heads, queries)), buckets)
            },
        );
        drawn(inputs, |((count, heads, queries), buckets), seed| {
            let buckets: Arc<[usize]> = buckets.into();
            case(&[&[count, heads]], seed, 0.0, move |tape, v| {
                tape.relative_bias(v[0], &buckets, queries)
            })
        })
    }
}

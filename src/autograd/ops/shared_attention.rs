//! Attention of several heads to keys and values that they share: the tokens themselves
//! (multi-query attention, Shazeer 2019).
//!
//! ```text
//! q [windows * t, heads * c], x [windows * t, c] -> y [windows * t, heads * c];
//! for each window and head, with q_h [t, c]:
//! S = scale q_h x^T [t, t], P = softmax(S), D = dropout(P), y_h = D x.
//! ```
//!
//! The heads of a token are so many more queries to the same window: the rest is
//! [`super::attention`] with one head.

use super::attention::{Attention, AttentionShape, HeadColumns, Operand};
use super::shapes_error;
use crate::autograd::{AutogradError, Real, Tape, Var};

impl<T: Real> Tape<'_, T> {
    /// Attention of each window's `tokens` tokens to each other, with queries
    /// `q [windows * tokens, heads * c]` and the tokens `x [windows * tokens, c]` as keys and
    /// values of every head, as `[windows * tokens, heads * c]`; scores times `scale`, dropout with
    /// probability `p` on the attention weights.
    ///
    /// # Errors
    /// Rows that are no whole windows, queries that are not some heads of c columns for each token,
    /// a probability that is none.
    pub fn shared_attention(
        &mut self,
        q: Var,
        x: Var,
        tokens: usize,
        scale: f64,
        p: f64,
    ) -> Result<Var, AutogradError> {
        self.own("shared_attention", &[q, x])?;
        let (left, right) = (self.shape(q), self.shape(x));
        let (&[rows, all], &[others, width]) = (left, right) else {
            let expected = "q [rows, heads * c] and x [rows, c]";
            return Err(shapes_error("shared_attention", left, right, expected));
        };
        let whole = tokens > 0 && rows % tokens == 0 && width > 0 && all > 0 && all % width == 0;
        if rows != others || !whole {
            let expected = "q [windows * tokens, heads * c] and x [windows * tokens, c]";
            return Err(shapes_error("shared_attention", left, right, expected));
        }
        let shape = AttentionShape {
            heads: 1,
            width,
            queries: tokens.saturating_mul(all / width),
            keys: tokens,
        };
        let operand = |value| Operand {
            columns: HeadColumns { value, start: 0 },
            stride: width,
        };
        let attention = Attention {
            q: operand(q),
            k: operand(x),
            v: operand(x),
            bias: None,
            shape,
            scale,
            dropout: self.next_draws("shared_attention", p)?,
            probabilities: Vec::new(),
        };
        Ok(attention.record(self, "shared_attention", &[rows, all]))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use crate::autograd::check::property::{Cases, case, drawn, strength};

    /// With and without dropout; more tokens than a padded chunk; small scores and large.
    pub fn cases() -> Cases {
        let sizes = (0usize..3, 1usize..11, 1usize..4, 1usize..4);
        let inputs = (sizes, any::<bool>(), strength());
        drawn(inputs, |(sizes, dropout, strength), seed| {
            let (windows, tokens, heads, width) = sizes;
            let rows = windows * tokens;
            let shapes: [&[usize]; 2] = [&[rows, heads * width], &[rows, width]];
            case(&shapes, seed, 0.0, move |tape, v| {
                tape.set_dropout(dropout.then_some(seed));
                tape.shared_attention(v[0], v[1], tokens, 0.7 * strength, 0.3)
            })
        })
    }
}

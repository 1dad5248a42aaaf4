//! The matrix of an invertible linear layer from its factors (Kingma and Dhariwal 2018, eq. 10).
//!
//! ```text
//! l, u [D, D], log_s [D], a permutation matrix P and signs of 1 or -1 that are fixed:
//! L = tril(l, -1) + I, U = triu(u, 1) + diag(sign_s e^log_s), W = P L U [D, D];
//! dM = P^T dW, dl = tril(dM U^T, -1), dU = L^T dM, du = triu(dU, 1),
//! dlog_s = diag(dU) sign_s e^log_s.
//! ```

use super::{argument_error, shapes_error};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

/// The factors of a matrix P L U on a tape.
#[derive(Debug, Clone, Copy)]
pub struct PluFactors {
    /// `[D, D]`; what is not below the diagonal does not count.
    pub l: Var,
    /// `[D, D]`; what is not above the diagonal does not count.
    pub u: Var,
    /// `[D]`
    pub log_s: Var,
}

struct PluProduct<T> {
    factors: PluFactors,
    /// The row of L U that each row of W is.
    rows: Vec<usize>,
    signs: Vec<T>,
}

/// L and U, `[D, D]` each.
fn triangles<T: Real>(l: &[T], u: &[T], log_s: &[T], signs: &[T]) -> (Vec<T>, Vec<T>) {
    let d = log_s.len();
    let (mut lower, mut upper) = (vec![T::zero(); d * d], vec![T::zero(); d * d]);
    for i in 0..d {
        lower[i * d..i * d + i].copy_from_slice(&l[i * d..i * d + i]);
        lower[i * d + i] = T::one();
        upper[i * d + i] = signs[i] * log_s[i].exp();
        upper[i * d + i + 1..(i + 1) * d].copy_from_slice(&u[i * d + i + 1..(i + 1) * d]);
    }
    (lower, upper)
}

impl<T: Real> Operation<T> for PluProduct<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let PluFactors { l, u, log_s } = self.factors;
        let d = self.rows.len();
        let logs = context.values(log_s);
        let (lower, upper) = triangles(context.values(l), context.values(u), logs, &self.signs);
        let mut dm = context.take(d * d);
        for (&row, dy) in self.rows.iter().zip(dy.chunks_exact(d)) {
            dm[row * d..(row + 1) * d].copy_from_slice(dy);
        }
        if let Some(target) = context.target(l) {
            let dl = target.so_far();
            for i in 0..d {
                for j in 0..i {
                    let products = (j..d).map(|k| dm[i * d + k] * upper[j * d + k]);
                    dl[i * d + j] += products.fold(T::zero(), |sum, x| sum + x);
                }
            }
        }
        // dU where it counts: row i of it is the sum over k >= i of L[k, i] dM[k, ..].
        let mut du_all = context.take(d * d);
        du_all.fill(T::zero());
        for i in 0..d {
            for k in i..d {
                let factor = lower[k * d + i];
                for j in i..d {
                    du_all[i * d + j] += factor * dm[k * d + j];
                }
            }
        }
        if let Some(target) = context.target(u) {
            let du = target.so_far();
            for i in 0..d {
                for j in i + 1..d {
                    du[i * d + j] += du_all[i * d + j];
                }
            }
        }
        if let Some(target) = context.target(log_s) {
            let dlog_s = target.so_far();
            for i in 0..d {
                dlog_s[i] += du_all[i * d + i] * upper[i * d + i];
            }
        }
        context.give(dm);
        context.give(du_all);
    }
}

impl<T: Real> Tape<'_, T> {
    /// W = P L U, `[D, D]`: row i of W is row `rows[i]` of L U; `signs [D]` are those of U's
    /// diagonal.
    ///
    /// # Errors
    /// Factors of other shapes; rows that are no permutation, or signs that are none.
    pub fn plu_product(
        &mut self,
        factors: PluFactors,
        rows: &[usize],
        signs: &[T],
    ) -> Result<Var, AutogradError> {
        let PluFactors { l, u, log_s } = factors;
        let all = [l, u, log_s];
        self.own("plu_product", &all)?;
        let d = rows.len();
        for (factor, wanted) in [(l, &[d, d][..]), (u, &[d, d][..]), (log_s, &[d][..])] {
            let found = self.shape(factor);
            if found != wanted {
                let expected = "l and u [D, D], log_s [D] for D rows";
                return Err(shapes_error("plu_product", wanted, found, expected));
            }
        }
        let mut seen = vec![false; d];
        let permutation = rows
            .iter()
            .all(|&row| row < d && !std::mem::replace(&mut seen[row], true));
        let signed = signs.len() == d && signs.iter().all(|sign| sign.abs() == T::one());
        if !permutation || !signed {
            let argument = format!("rows {rows:?}, signs {signs:?}");
            let expected = "a permutation of the D rows and D signs of 1 or -1";
            return Err(argument_error("plu_product", &[d, d], argument, expected));
        }
        let logs = self.values(log_s);
        let (lower, upper) = triangles(self.values(l), self.values(u), logs, signs);
        let mut y = self.take(d * d);
        y.fill(T::zero());
        for (i, &row) in rows.iter().enumerate() {
            let out = &mut y[i * d..(i + 1) * d];
            for k in 0..=row {
                let factor = lower[row * d + k];
                for j in k..d {
                    out[j] += factor * upper[k * d + j];
                }
            }
        }
        let operation = || PluProduct {
            factors,
            rows: rows.to_vec(),
            signs: signs.to_vec(),
        };
        Ok(self.put("plu_product", &all, &[d, d], y, operation))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use proptest::prelude::*;

    use super::PluFactors;
    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        let inputs = (0usize..6).prop_flat_map(|d| {
            let signs = prop::collection::vec(any::<bool>(), d);
            (Just((0..d).collect::<Vec<_>>()).prop_shuffle(), signs)
        });
        drawn(inputs, |(rows, signs), seed| {
            let d = rows.len();
            let signs: Vec<f64> = signs
                .iter()
                .map(|&up| if up { 1.0 } else { -1.0 })
                .collect();
            case(&[&[d, d], &[d, d], &[d]], seed, 0.0, move |tape, v| {
                let factors = PluFactors {
                    l: v[0],
                    u: v[1],
                    log_s: v[2],
                };
                tape.plu_product(factors, &rows, &signs)
            })
        })
    }
}

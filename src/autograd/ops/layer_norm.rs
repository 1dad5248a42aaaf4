//! Layer normalisation along the last axis, and the core it shares with [`super::add_layer_norm`].
//!
//! ```text
//! z = residual + dropout(x), xhat = (z - mean(z)) / sqrt(var(z) + 1e-5), y = xhat gamma + beta;
//! with g = dY gamma: dZ = (g - mean(g) - xhat mean(g xhat)) / sqrt(var + 1e-5),
//! dgamma = sum dY xhat, dbeta = sum dY, dresidual = dZ, dX = dropout(dZ) with the same mask.
//! Only mean and 1 / sqrt(var + 1e-5) of each row are kept.
//! ```

use super::shapes_error;
use crate::autograd::kernels::{dropout_into, dropped_into, vectorised};
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var, Workspace};

const EPS: f64 = 1e-5;

pub(super) struct LayerNorm<T> {
    x: Var,
    residual: Option<Var>,
    gamma: Var,
    beta: Var,
    dropout: Option<(u64, f64)>,
    columns: usize,
    /// mean, 1 / sqrt(var + eps) of each row, `[rows, 2]`.
    statistics: Vec<T>,
}

/// z = residual + dropout(x), in a buffer.
fn sum_into<T: Real>(z: &mut [T], x: &[T], residual: Option<&[T]>, dropout: Option<(u64, f64)>) {
    dropped_into(dropout, x, z);
    if let Some(residual) = residual {
        vectorised(
            #[inline(always)]
            || z.iter_mut().zip(residual).for_each(|(z, &r)| *z += r),
        );
    }
}

impl<T: Real> Operation<T> for LayerNorm<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let columns = self.columns;
        let gamma = context.values(self.gamma);
        let residual = self.residual.map(|residual| context.values(residual));
        let mut z = context.take(dy.len());
        sum_into(&mut z, context.values(self.x), residual, self.dropout);
        let mut weights = context.take(2 * columns);
        weights.fill(T::zero());
        let (dgamma, dbeta) = weights.split_at_mut(columns);
        let scale = T::one() / T::from_f64(columns as f64);
        vectorised(
            #[inline(always)]
            || {
                for ((dy, z), statistics) in dy
                    .chunks_exact_mut(columns)
                    .zip(z.chunks_exact_mut(columns))
                    .zip(self.statistics.chunks_exact(2))
                {
                    let (mean, inverse) = (statistics[0], statistics[1]);
                    // Lengths that the compiler sees, for loops without bounds checks.
                    let (dgamma, dbeta) = (&mut dgamma[..columns], &mut dbeta[..columns]);
                    let (dy, z, gamma) = (&mut dy[..columns], &mut z[..columns], &gamma[..columns]);
                    for j in 0..columns {
                        z[j] = (z[j] - mean) * inverse;
                        dgamma[j] += dy[j] * z[j];
                        dbeta[j] += dy[j];
                        dy[j] *= gamma[j];
                    }
                    let mean_g = sum_with(columns, |j| dy[j]) * scale;
                    let mean_gx = sum_with(columns, |j| dy[j] * z[j]) * scale;
                    for j in 0..columns {
                        dy[j] = (dy[j] - mean_g - z[j] * mean_gx) * inverse;
                    }
                }
            },
        );
        if let Some(target) = context.target(self.gamma) {
            target.add_values(dgamma);
        }
        if let Some(target) = context.target(self.beta) {
            target.add_values(dbeta);
        }
        if let Some(target) = self.residual.and_then(|residual| context.target(residual)) {
            target.add_values(dy);
        }
        if let Some(target) = context.target(self.x) {
            match self.dropout {
                None => target.add_values(dy),
                Some((key, p)) if target.fresh => dropout_into(key, p, dy, target.data),
                Some((key, p)) => {
                    dropout_into(key, p, dy, &mut z);
                    target.add_values(&z);
                }
            }
        }
        context.give(z);
        context.give(weights);
    }

    fn release(&mut self, workspace: &mut Workspace<T>) {
        workspace.give(std::mem::take(&mut self.statistics));
    }
}

pub(super) fn layer_norm<T: Real>(
    tape: &mut Tape<'_, T>,
    name: &'static str,
    x: Var,
    residual: Option<Var>,
    (gamma, beta): (Var, Var),
    dropout: Option<(u64, f64)>,
) -> Result<Var, AutogradError> {
    let mut inputs = vec![x, gamma, beta];
    inputs.extend(residual);
    tape.own(name, &inputs)?;
    let shape = tape.shape(x).to_vec();
    let (rows, columns) = tape.rows_and_columns(x);
    for weight in [gamma, beta] {
        if shape.is_empty() || tape.shape(weight) != [columns] {
            let expected = "x [.., n] and gamma, beta [n]";
            return Err(shapes_error(name, &shape, tape.shape(weight), expected));
        }
    }
    if let Some(residual) = residual
        && tape.shape(residual) != shape
    {
        let expected = "x and residual of one shape";
        return Err(shapes_error(name, &shape, tape.shape(residual), expected));
    }
    let mut y = tape.take(rows * columns);
    let mut statistics = tape.take(rows * 2);
    let values = residual.map(|residual| tape.values(residual));
    sum_into(&mut y, tape.values(x), values, dropout);
    let (g, b) = (tape.values(gamma), tape.values(beta));
    let scale = T::one() / T::from_f64(columns as f64);
    if columns > 0 {
        vectorised(
            #[inline(always)]
            || {
                let rows = y.chunks_exact_mut(columns);
                for (z, statistics) in rows.zip(statistics.chunks_exact_mut(2)) {
                    let (z, g, b) = (&mut z[..columns], &g[..columns], &b[..columns]);
                    let mean = sum_with(columns, |j| z[j]) * scale;
                    let variance = sum_with(columns, |j| (z[j] - mean) * (z[j] - mean)) * scale;
                    let inverse = T::one() / (variance + T::from_f64(EPS)).sqrt();
                    for j in 0..columns {
                        z[j] = (z[j] - mean) * inverse * g[j] + b[j];
                    }
                    statistics[0] = mean;
                    statistics[1] = inverse;
                }
            },
        );
    }
    if !tape.is_recording() {
        tape.give(std::mem::take(&mut statistics));
    }
    Ok(tape.put(name, &inputs, &shape, y, || LayerNorm {
        x,
        residual,
        gamma,
        beta,
        dropout,
        columns,
        statistics,
    }))
}

impl<T: Real> Tape<'_, T> {
    /// `x [.., n]` normalised along the last axis, times `gamma [n]`, plus `beta [n]` (eps 1e-5).
    ///
    /// # Errors
    /// Weights of another shape.
    pub fn layer_norm(&mut self, x: Var, gamma: Var, beta: Var) -> Result<Var, AutogradError> {
        layer_norm(self, "layer_norm", x, None, (gamma, beta), None)
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        drawn((0usize..4, 2usize..9), |(rows, n), seed| {
            case(&[&[rows, n], &[n], &[n]], seed, 0.3, |tape, v| {
                tape.layer_norm(v[0], v[1], v[2])
            })
        })
    }
}

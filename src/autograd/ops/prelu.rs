//! Parametric rectified linear unit (He et al. 2015) with one learned slope.
//!
//! ```text
//! x [..], slope [1] -> y = x where x > 0, else slope x;
//! dX = dY or slope dY, dslope = sum of dY x where x <= 0.
//! ```

use super::shapes_error;
use crate::autograd::kernels::vectorised;
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Prelu {
    x: Var,
    slope: Var,
}

impl<T: Real> Operation<T> for Prelu {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (x, slope) = (context.values(self.x), context.values(self.slope)[0]);
        if let Some(target) = context.target(self.slope) {
            let dy = &dy[..x.len()];
            let sum = vectorised(
                #[inline(always)]
                || {
                    sum_with(x.len(), |i| {
                        if x[i] > T::zero() {
                            T::zero()
                        } else {
                            dy[i] * x[i]
                        }
                    })
                },
            );
            target.add(|_| sum);
        }
        if let Some(target) = context.target(self.x) {
            vectorised(
                #[inline(always)]
                || {
                    for (dy, &x) in dy.iter_mut().zip(x) {
                        *dy = if x > T::zero() { *dy } else { slope * *dy };
                    }
                },
            );
            target.add_values(dy);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x` with its negative part scaled by `slope [1]`.
    ///
    /// # Errors
    /// A slope that is not one number.
    pub fn prelu(&mut self, x: Var, slope: Var) -> Result<Var, AutogradError> {
        self.own("prelu", &[x, slope])?;
        if self.values(slope).len() != 1 {
            let (left, right) = (self.shape(x), self.shape(slope));
            return Err(shapes_error("prelu", left, right, "one slope"));
        }
        let shape = self.shape(x).to_vec();
        let mut y = self.take(self.values(x).len());
        let (values, a) = (self.values(x), self.values(slope)[0]);
        vectorised(
            #[inline(always)]
            || {
                for (y, &x) in y.iter_mut().zip(values) {
                    *y = if x > T::zero() { x } else { a * x };
                }
            },
        );
        Ok(self.put("prelu", &[x, slope], &shape, y, || Prelu { x, slope }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn(shapes(), |x, seed| {
            case(&[&x, &[1]], seed, 0.01, |tape, v| tape.prelu(v[0], v[1]))
        })
    }
}

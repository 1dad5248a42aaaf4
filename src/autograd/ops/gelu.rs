//! Gaussian error linear unit (Hendrycks and Gimpel 2016), the exact one.
//!
//! ```text
//! y = x Phi(x), Phi the distribution function of the standard normal, (1 + erf(x / sqrt(2))) / 2;
//! dX = dY (Phi(x) + x phi(x)), phi(x) = exp(-x^2 / 2) / sqrt(2 pi).
//! Both are computed again on the way back: to keep the factor of dY instead would save an eighth
//! of the time and hold as many numbers as x.
//! ```

use crate::autograd::kernels::vectorised;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct Gelu {
    x: Var,
}

impl<T: Real> Operation<T> for Gelu {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let x = context.values(self.x);
        let Some(target) = context.target(self.x) else {
            return;
        };
        vectorised(
            #[inline(always)]
            || {
                for (dy, x) in dy.iter_mut().zip(x) {
                    *dy *= x.gelu_slope_lane();
                }
            },
        );
        target.add_values(dy);
    }
}

impl<T: Real> Tape<'_, T> {
    /// x Phi(x), elementwise, Phi the distribution function of the standard normal.
    pub fn gelu(&mut self, x: Var) -> Var {
        if let Err(error) = self.own("gelu", &[x]) {
            return self.refuse(error);
        }
        let (shape, mut y) = self.copy(x);
        T::gelu_slice(&mut y);
        self.put("gelu", &[x], &shape, y, || Gelu { x })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.gelu(x)))
    }
}

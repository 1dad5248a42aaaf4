//! Dropout.
//!
//! ```text
//! y = x m / (1 - p), m drawn 0 with probability p, else 1; dX = dY m / (1 - p).
//! The mask is drawn again on the way back.
//! ```

use crate::autograd::kernels::dropout_into;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Dropout {
    x: Var,
    p: f64,
    key: u64,
}

impl<T: Real> Operation<T> for Dropout {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        if !context.needs_gradient(self.x) {
            return;
        }
        let mut dx = context.take(dy.len());
        dropout_into(self.key, self.p, dy, &mut dx);
        if let Some(target) = context.target(self.x) {
            target.add_values(&dx);
        }
        context.give(dx);
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x` with each number set to 0 with probability `p` and the others scaled up; `x` itself
    /// where dropout is off.
    ///
    /// # Errors
    /// A probability that is none; a value of another tape.
    pub fn dropout(&mut self, x: Var, p: f64) -> Result<Var, AutogradError> {
        self.own("dropout", &[x])?;
        let Some((key, p)) = self.next_draws("dropout", p)? else {
            return Ok(x);
        };
        let shape = self.known().shape(x).to_vec();
        let mut y = self.take(self.known().values(x).len());
        dropout_into(key, p, self.known().values(x), &mut y);
        Ok(self.put("dropout", &[x], &shape, y, || Dropout { x, p, key }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn((shapes(), 0.0..0.9), |(x, p), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.set_dropout(Some(seed));
                tape.dropout(v[0], p)
            })
        })
    }
}

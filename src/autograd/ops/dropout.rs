//! Dropout.
//!
//! ```text
//! y = x m / (1 - p), m drawn 0 with probability p, else 1; dX = dY m / (1 - p).
//! The mask is drawn again on the way back.
//! ```

use crate::autograd::kernels::dropout_into;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

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
    pub fn dropout(&mut self, x: Var, p: f64) -> Var {
        let draws = self.own("dropout", &[x]);
        let (key, p) = match draws.and_then(|()| self.next_draws("dropout", p)) {
            Ok(Some(draws)) => draws,
            Ok(None) => return x,
            Err(error) => return self.refuse(error),
        };
        let shape = self.shape(x).to_vec();
        let mut y = self.take(self.values(x).len());
        dropout_into(key, p, self.values(x), &mut y);
        self.put("dropout", &[x], &shape, y, || Dropout { x, p, key })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn((shapes(), 0.0..0.9), |(x, p), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.set_dropout(Some(seed));
                Ok(tape.dropout(v[0], p))
            })
        })
    }
}

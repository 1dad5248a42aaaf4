//! Sum of all numbers.
//!
//! ```text
//! x [..] -> y [1]; dX = dY everywhere.
//! ```

use crate::autograd::reduce::sum_with;
use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct Sum {
    x: Var,
}

impl<T: Real> Operation<T> for Sum {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let upstream = dy[0];
        if let Some(target) = context.target(self.x) {
            target.add(|_| upstream);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// Sum of all numbers of `x`, as `[1]`.
    pub fn sum(&mut self, x: Var) -> Var {
        if let Err(error) = self.own("sum", &[x]) {
            return self.refuse(error);
        }
        let mut y = self.take(1);
        let values = self.values(x);
        y[0] = sum_with(values.len(), |i| values[i]);
        self.put("sum", &[x], &[1], y, || Sum { x })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_one_value};

    pub fn cases() -> Cases {
        of_one_value(0.0, |tape, x| Ok(tape.sum(x)))
    }
}

//! What the elementwise functions of one value share.

use crate::autograd::{Backward, Operation, Real, Tape, Var};

struct Unary<D> {
    x: Var,
    derivative: D,
}

impl<T: Real, D: Fn(T, T) -> T + Send> Operation<T> for Unary<D> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (x, y) = (context.values(self.x), context.output());
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i] * (self.derivative)(x[i], y[i]));
        }
    }
}

/// y = forward(x) in place on a copy; dX = dY * derivative(x, y).
pub(super) fn unary<T: Real>(
    tape: &mut Tape<'_, T>,
    name: &'static str,
    x: Var,
    forward: impl Fn(&mut [T]),
    derivative: impl Fn(T, T) -> T + Send + 'static,
) -> Var {
    if let Err(error) = tape.own(name, &[x]) {
        return tape.refuse(error);
    }
    let (shape, mut y) = tape.copy(x);
    forward(&mut y);
    tape.put(name, &[x], &shape, y, || Unary { x, derivative })
}

//! Quotient of two values, element by element.
//!
//! ```text
//! c = a / b, with a and b broadcast to c's shape;
//! dA = dC / b, dB = -dC * a / b^2, summed over the broadcast axes.
//! ```

use super::broadcast::{add_reduced, broadcast_shape, zip_into};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Div {
    a: Var,
    b: Var,
    shape: Vec<usize>,
}

impl<T: Real> Operation<T> for Div {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let [a, b] = [self.a, self.b].map(|operand| context.array(operand));
        let [of_a, of_b] = [self.a, self.b].map(|operand| context.shape(operand));
        let shape = self.shape.as_slice();
        let (Some(a), Some(b)) = (a.broadcast(shape), b.broadcast(shape)) else {
            return;
        };
        if let Some(target) = context.target(self.a) {
            let gradient = dy.iter().zip(&b).map(|(&d, &b)| d / b);
            add_reduced(target, of_a, shape, gradient);
        }
        if let Some(target) = context.target(self.b) {
            let numbers = dy.iter().zip(&a).zip(&b);
            let gradient = numbers.map(|((&d, &a), &b)| -d * a / (b * b));
            add_reduced(target, of_b, shape, gradient);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// a / b, elementwise with broadcasting.
    ///
    /// # Errors
    /// Shapes that do not broadcast together, a value of another tape.
    pub fn div(&mut self, a: Var, b: Var) -> Result<Var, AutogradError> {
        self.own("div", &[a, b])?;
        let shape = broadcast_shape("div", self.shape(a), self.shape(b))?;
        let mut y = self.take_for("div", &shape)?;
        let [left, right] = [a, b].map(|operand| self.array(operand));
        zip_into(&mut y, &shape, left, right, |x, y| x / y);
        Ok(self.put("div", &[a, b], &shape, y, || Div {
            a,
            b,
            shape: shape.clone(),
        }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, of_two_values};

    pub fn cases() -> Cases {
        of_two_values(|tape, a, b| {
            let square = tape.square(b);
            let divisor = tape.affine(square, 1.0, 0.5);
            tape.div(a, divisor)
        })
    }
}

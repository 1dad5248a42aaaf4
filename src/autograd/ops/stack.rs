//! Values of one shape on top of each other, along a new first axis.
//!
//! ```text
//! x_i [..] -> y [parts, ..]; dX_i = dY[i].
//! ```

use super::{argument_error, shapes_error};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Stack {
    parts: Vec<Var>,
}

impl<T: Real> Operation<T> for Stack {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let len = dy.len() / self.parts.len();
        for (k, &part) in self.parts.iter().enumerate() {
            if let Some(target) = context.target(part) {
                let dy = &dy[k * len..(k + 1) * len];
                target.add_values(dy);
            }
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The parts `[..]` under a new first axis: `[parts, ..]`.
    ///
    /// # Errors
    /// No part, or parts of different shapes.
    pub fn stack(&mut self, parts: &[Var]) -> Result<Var, AutogradError> {
        self.own("stack", parts)?;
        let Some(&first) = parts.first() else {
            let expected = "at least one part";
            return Err(argument_error("stack", &[], "no parts".into(), expected));
        };
        for &part in parts {
            if self.shape(part) != self.shape(first) {
                let (left, right) = (self.shape(first), self.shape(part));
                return Err(shapes_error("stack", left, right, "equal shapes"));
            }
        }
        let len = self.values(first).len();
        let mut y = self.take(len * parts.len());
        for (k, &part) in parts.iter().enumerate() {
            y[k * len..(k + 1) * len].copy_from_slice(self.values(part));
        }
        let mut shape = vec![parts.len()];
        shape.extend_from_slice(self.shape(first));
        Ok(self.put("stack", parts, &shape, y, || Stack {
            parts: parts.to_vec(),
        }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    /// The first part stands at both ends, so that its gradient adds up.
    pub fn cases() -> Cases {
        drawn(shapes(), |x, seed| {
            case(&[&x, &x], seed, 0.0, |tape, v| {
                tape.stack(&[v[0], v[1], v[0]])
            })
        })
    }
}

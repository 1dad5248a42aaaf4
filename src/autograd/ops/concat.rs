//! Values side by side along the last axis.
//!
//! x_i [.., n_i] -> y [.., sum n_i]; dX_i is dY's columns of x_i.

use super::{argument_error, shapes_error};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Concat {
    parts: Vec<(Var, usize)>,
    total: usize,
}

impl<T: Real> Operation<T> for Concat {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let mut start = 0;
        for &(part, width) in &self.parts {
            if let Some(target) = context.target(part)
                && width > 0
            {
                let fresh = target.fresh;
                let rows = target.data.chunks_exact_mut(width);
                for (dx, dy) in rows.zip(dy.chunks_exact(self.total)) {
                    let dy = &dy[start..start + width];
                    if fresh {
                        dx.copy_from_slice(dy);
                    } else {
                        dx.iter_mut().zip(dy).for_each(|(dx, &dy)| *dx += dy);
                    }
                }
            }
            start += width;
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The parts `[.., n_i]` beside each other: `[.., n_1 + n_2 + ..]`.
    ///
    /// # Errors
    /// No part, or parts that differ in an axis before the last.
    pub fn concat(&mut self, parts: &[Var]) -> Result<Var, AutogradError> {
        self.own("concat", parts)?;
        let (shape, y) = self.join("concat", parts)?;
        let total = shape.last().copied().unwrap_or(1);
        let widths = parts
            .iter()
            .map(|&part| (part, self.rows_and_columns(part).1));
        let widths = widths.collect();
        Ok(self.put("concat", parts, &shape, y, || Concat {
            parts: widths,
            total,
        }))
    }

    /// Shape and numbers of the parts beside each other, in a buffer of their own.
    pub(super) fn join(
        &mut self,
        operation: &'static str,
        parts: &[Var],
    ) -> Result<(Vec<usize>, Vec<T>), AutogradError> {
        let Some(&first) = parts.first() else {
            let expected = "at least one part";
            return Err(argument_error(operation, &[], "no parts".into(), expected));
        };
        let mut shape = self.shape(first).to_vec();
        let lead = shape.len().saturating_sub(1);
        for &part in parts {
            let other = self.shape(part);
            if other.is_empty() || other.len() != shape.len() || other[..lead] != shape[..lead] {
                let expected = "equal axes before the last";
                return Err(shapes_error(operation, &shape, other, expected));
            }
        }
        let widths: Vec<(Var, usize)> = parts
            .iter()
            .map(|&part| (part, self.rows_and_columns(part).1))
            .collect();
        let rows = self.rows_and_columns(first).0;
        let total: usize = widths.iter().map(|(_, width)| width).sum();
        let mut y = self.take(rows * total);
        let mut start = 0;
        for &(part, width) in &widths {
            if width > 0 {
                let x = self.values(part).chunks_exact(width);
                for (y, x) in y.chunks_exact_mut(total).zip(x) {
                    y[start..start + width].copy_from_slice(x);
                }
            }
            start += width;
        }
        shape[lead] = total;
        Ok((shape, y))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    /// The first part stands at both ends, so that its gradient adds up.
    pub fn cases() -> Cases {
        drawn((0usize..4, 0usize..3, 0usize..3), |(rows, a, b), seed| {
            case(&[&[rows, a], &[rows, b]], seed, 0.0, |tape, v| {
                tape.concat(&[v[0], v[1], v[0]])
            })
        })
    }
}

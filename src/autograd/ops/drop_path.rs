//! Stochastic depth (Huang et al. 2016): a branch is dropped for whole groups of rows.
//!
//! ```text
//! x [groups * rows, ..] -> y = x m / (1 - p), m drawn for each group, 0 with probability p, else
//! 1; dX = dY m / (1 - p). The mask is drawn again on the way back.
//! ```

use super::argument_error;
use crate::autograd::kernels::{dropout_into, vectorised};
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct DropPath {
    x: Var,
    p: f64,
    key: u64,
    /// Numbers of a group.
    group: usize,
}

/// Multiplies each group in `y` with its m / (1 - p); `masks` are two buffers of a number a group.
fn drop_groups<T: Real>(key: u64, p: f64, y: &mut [T], group: usize, masks: [&mut [T]; 2]) {
    let [ones, factors] = masks;
    ones.fill(T::one());
    dropout_into(key, p, ones, factors);
    vectorised(
        #[inline(always)]
        || {
            for (y, &factor) in y.chunks_exact_mut(group).zip(&*factors) {
                y.iter_mut().for_each(|y| *y *= factor);
            }
        },
    );
}

impl<T: Real> Operation<T> for DropPath {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let groups = dy.len() / self.group;
        let [mut ones, mut factors] = [context.take(groups), context.take(groups)];
        let masks = [&mut ones[..], &mut factors[..]];
        drop_groups(self.key, self.p, dy, self.group, masks);
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
        context.give(ones);
        context.give(factors);
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x [groups * rows, ..]` with each group of `rows` rows set to 0 with probability `p` and the
    /// others scaled up; `x` itself where dropout is off.
    ///
    /// # Errors
    /// Rows that are no whole groups; a probability that is none.
    pub fn drop_path(&mut self, x: Var, p: f64, rows: usize) -> Result<Var, AutogradError> {
        self.own("drop_path", &[x])?;
        let shape = self.shape(x);
        let all = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || rows == 0 || !all.is_multiple_of(rows) {
            let argument = format!("groups of {rows} rows");
            let expected = "[groups * rows, ..]";
            return Err(argument_error("drop_path", shape, argument, expected));
        }
        let Some((key, p)) = self.next_draws("drop_path", p)? else {
            return Ok(x);
        };
        let (shape, mut y) = self.copy(x);
        // Without any number groups may be of any size.
        let group = y.len() / (all / rows).max(1);
        if !y.is_empty() {
            let [mut ones, mut factors] = [self.take(all / rows), self.take(all / rows)];
            let masks = [&mut ones[..], &mut factors[..]];
            drop_groups(key, p, &mut y, group, masks);
            self.give(ones);
            self.give(factors);
        }
        let operation = || DropPath { x, p, key, group };
        Ok(self.put("drop_path", &[x], &shape, y, operation))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        let inputs = ([0usize..5, 1..4, 0..3], 0.0..0.9);
        drawn(inputs, |([groups, rows, k], p), seed| {
            case(&[&[groups * rows, k]], seed, 0.0, move |tape, v| {
                tape.set_dropout(Some(seed));
                tape.drop_path(v[0], p, rows)
            })
        })
    }
}

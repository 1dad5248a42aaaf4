//! Root trajectory reconstruction in the graph, eq. 7 to 11.

use crate::autograd::{AutogradError, Real, Tape, Var};

/// R from R_1, `[rows, 3]`, cm, of windows of `frames` rows each.
///
/// ```text
/// step_t = - sum_f s_f,t (P_f,t+1 - P_f,t),   R_t = R_1 + step_1 + .. + step_(t-1)
/// ```
///
/// `feet`: P of the right and of the left foot relative to the root, each `[rows, 3]`, cm;
/// `weights`: s, `[rows, 2]`. The way back is a reversed cumulative sum, which the operations have.
///
/// # Errors
/// Operands of other shapes.
pub fn reconstruct_root<T: Real>(
    tape: &mut Tape<'_, T>,
    feet: [Var; 2],
    weights: Var,
    frames: usize,
) -> Result<Var, AutogradError> {
    let rows = tape.shape(weights).first().copied().unwrap_or(0);
    let steps = rows.saturating_sub(1);
    // A row's own step leads to the next row; the first row of a window is led to by none.
    let led = tape.constant_with(&[steps, 1], |mask| {
        for (row, x) in mask.iter_mut().enumerate() {
            let starts = (row + 1).is_multiple_of(frames.max(1));
            *x = if starts { T::zero() } else { -T::one() };
        }
    });
    let before = tape.rows(weights, 0..steps)?;
    let mut sum = None;
    for (foot, positions) in feet.into_iter().enumerate() {
        let (from, to) = (
            tape.rows(positions, 0..steps)?,
            tape.rows(positions, 1..rows)?,
        );
        let moved = tape.sub(to, from)?;
        let weight = tape.columns(before, foot..foot + 1)?;
        let weight = tape.mul(weight, led)?;
        let step = tape.mul(moved, weight)?;
        sum = Some(match sum {
            None => step,
            Some(other) => tape.add(other, step)?,
        });
    }
    let none = tape.constant_with(&[1, 3], |zero| zero.fill(T::zero()));
    let led_by = match sum {
        Some(sum) => {
            let sum = tape.reshape(sum, &[1, 3 * steps])?;
            let joined = tape.concat(&[none, sum])?;
            tape.reshape(joined, &[rows, 3])?
        }
        None => none,
    };
    tape.cumulative_sum(led_by, frames)
}

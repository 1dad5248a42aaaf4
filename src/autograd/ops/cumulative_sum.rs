//! Sums over the frames so far, within windows.
//!
//! ```text
//! x [windows * frames, ..] -> y likewise, y_t = x_1 + .. + x_t inside each window;
//! dX_t = dY_t + .. + dY_frames.
//! ```

use super::argument_error;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct CumulativeSum {
    x: Var,
    /// Numbers of a frame, and of a window.
    frame: usize,
    window: usize,
}

impl<T: Real> Operation<T> for CumulativeSum {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let frame = self.frame;
        for window in dy.chunks_exact_mut(self.window) {
            for i in (0..window.len() - frame).rev() {
                let later = window[i + frame];
                window[i] += later;
            }
        }
        if let Some(target) = context.target(self.x) {
            target.add_values(dy);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// The sum of each row of `x [windows * frames, ..]` and those before it in its window of
    /// `frames` rows, in the shape of `x`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn cumulative_sum(&mut self, x: Var, frames: usize) -> Result<Var, AutogradError> {
        self.own("cumulative_sum", &[x])?;
        let shape = self.shape(x);
        let rows = shape.first().copied().unwrap_or(0);
        if shape.is_empty() || frames == 0 || !rows.is_multiple_of(frames) {
            let argument = format!("windows of {frames} frames");
            let expected = "[windows * frames, ..]";
            return Err(argument_error("cumulative_sum", shape, argument, expected));
        }
        let (shape, mut y) = self.copy(x);
        // Without any number windows may be of any size.
        let frame: usize = shape.iter().skip(1).product();
        let window = frame.saturating_mul(frames);
        if !y.is_empty() {
            for window in y.chunks_exact_mut(window) {
                for i in frame..window.len() {
                    let earlier = window[i - frame];
                    window[i] += earlier;
                }
            }
        }
        let name = "cumulative_sum";
        Ok(self.put(name, &[x], &shape, y, || CumulativeSum { x, frame, window }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn};

    pub fn cases() -> Cases {
        drawn([0usize..4, 1..5, 0..3], |[windows, frames, k], seed| {
            case(&[&[windows * frames, k]], seed, 0.0, move |tape, v| {
                tape.cumulative_sum(v[0], frames)
            })
        })
    }
}

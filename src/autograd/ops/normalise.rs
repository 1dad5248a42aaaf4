//! Vectors scaled to length 1, such as quaternions.
//!
//! ```text
//! x [.., k width], in vectors of `width` numbers -> y = x / n, n = sqrt(x . x + eps);
//! dX = (dY - y (y . dY)) / n.
//! ```

use super::argument_error;
use super::vector_norm::smoothing;
use crate::autograd::reduce::sum_with;
use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Normalise<T> {
    x: Var,
    width: usize,
    eps: T,
}

fn length<T: Real>(x: &[T], eps: T) -> T {
    (sum_with(x.len(), |i| x[i] * x[i]) + eps).sqrt()
}

impl<T: Real> Operation<T> for Normalise<T> {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        let (x, y, width) = (context.values(self.x), context.output(), self.width);
        let vectors = x.chunks_exact(width).zip(y.chunks_exact(width));
        for (dy, (x, y)) in dy.chunks_exact_mut(width).zip(vectors) {
            let along = sum_with(width, |i| y[i] * dy[i]);
            let n = length(x, self.eps);
            dy.iter_mut()
                .zip(y)
                .for_each(|(dy, &y)| *dy = (*dy - y * along) / n);
        }
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i]);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x [.., k width]` with each `width` numbers in a row scaled to a vector of length 1; `eps`
    /// (above 0) keeps the gradient finite at 0.
    ///
    /// # Errors
    /// A last axis that is no multiple of `width`; an `eps` that is not above 0.
    pub fn normalise(&mut self, x: Var, width: usize, eps: f64) -> Result<Var, AutogradError> {
        self.own("normalise", &[x])?;
        let (shape, mut y) = self.copy(x);
        if width == 0 || !shape.last().is_some_and(|last| last.is_multiple_of(width)) {
            let argument = format!("vectors of {width} numbers");
            let expected = "a last axis that is a multiple of the vectors' width";
            return Err(argument_error("normalise", &shape, argument, expected));
        }
        let eps = smoothing("normalise", eps)?;
        for vector in y.chunks_exact_mut(width) {
            let n = length(vector, eps);
            vector.iter_mut().for_each(|x| *x /= n);
        }
        Ok(self.put("normalise", &[x], &shape, y, || Normalise { x, width, eps }))
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn((shapes(), 1usize..5), |(mut x, width), seed| {
            if let Some(last) = x.last_mut() {
                *last *= width;
            }
            case(&[&x], seed, 0.1, move |tape, v| {
                tape.normalise(v[0], width, 1e-3)
            })
        })
    }
}

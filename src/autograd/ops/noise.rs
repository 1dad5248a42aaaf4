//! Normal noise.
//!
//! ```text
//! y = x + deviation n, n drawn from N(0, 1) for each number; dX = dY.
//! ```

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::autograd::{AutogradError, Backward, Operation, Real, Tape, Var};

struct Noise {
    x: Var,
}

impl<T: Real> Operation<T> for Noise {
    fn backward(&self, dy: &mut [T], context: &mut Backward<'_, T>) {
        if let Some(target) = context.target(self.x) {
            target.add(|i| dy[i]);
        }
    }
}

impl<T: Real> Tape<'_, T> {
    /// `x` with noise of this standard deviation on each number, drawn by the key of the tape's
    /// dropout; `x` itself where dropout is off.
    pub fn noise(&mut self, x: Var, deviation: f64) -> Var {
        let valid = deviation >= 0.0 && deviation.is_finite();
        let asked = ("deviation", deviation);
        let valid = AutogradError::unless(valid, "noise", asked, "a number, 0 or more");
        if let Err(error) = valid.and(self.own("noise", &[x])) {
            return self.refuse(error);
        }
        let Some((key, deviation)) = self.next_key(deviation) else {
            return x;
        };
        let (shape, mut y) = self.copy(x);
        let mut rng = ChaCha8Rng::seed_from_u64(key);
        for y in &mut y {
            let drawn: f64 = StandardNormal.sample(&mut rng);
            *y += T::from_f64(deviation * drawn);
        }
        self.put("noise", &[x], &shape, y, || Noise { x })
    }
}

#[cfg(test)]
pub(super) mod gradient {
    use crate::autograd::check::property::{Cases, case, drawn, shapes};

    pub fn cases() -> Cases {
        drawn((shapes(), 0.0..2.0), |(x, deviation), seed| {
            case(&[&x], seed, 0.0, move |tape, v| {
                tape.set_dropout(Some(seed));
                Ok(tape.noise(v[0], deviation))
            })
        })
    }
}

//! Fully connected layers with PReLU between them.

use rand::Rng;

use super::{Initialiser, Linear};
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// The slope of a PReLU before training, as in PyTorch and in He et al. 2015.
const SLOPE: f64 = 0.25;

/// Linear, PReLU, Linear, PReLU, ..; named as a `torch.nn.Sequential` names them: `{name}.0`, `{name}.1`, ..
#[derive(Debug, Clone)]
pub struct Mlp {
    layers: Vec<(Linear, Option<BlockId>)>,
}

impl Mlp {
    /// Layers from `sizes[0]` to `sizes[1]` to ..; the last one has a PReLU of its own where `activate_last` says so.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: &[usize],
        activate_last: bool,
    ) -> Self {
        let last = sizes.len().saturating_sub(2);
        let layers = sizes
            .windows(2)
            .enumerate()
            .map(|(k, pair)| {
                let linear = Linear::new(init, &format!("{name}.{}", 2 * k), pair[0], pair[1]);
                let slope = (k < last || activate_last).then(|| {
                    let slope = format!("{name}.{}.weight", 2 * k + 1);
                    init.constant(slope, &[1], SLOPE).1
                });
                (linear, slope)
            })
            .collect();
        Self { layers }
    }

    /// `[.., sizes[0]]` -> `[.., last size]`.
    ///
    /// # Errors
    /// An input of another width.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        mut x: Var,
    ) -> Result<Var, AutogradError> {
        for (linear, slope) in &self.layers {
            x = linear.forward(tape, x)?;
            if let Some(slope) = *slope {
                let slope = tape.block(slope);
                x = tape.prelu(x, slope)?;
            }
        }
        Ok(x)
    }
}

//! Fully connected layers with an activation between them.

use rand::Rng;

use super::{Initialiser, Linear};
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};

/// The slope of a PReLU before training, as in PyTorch and in He et al. 2015.
const SLOPE: f64 = 0.25;

/// What stands behind a layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Activation {
    /// With one learned slope a layer.
    Prelu,
    Plu,
    Relu,
}

/// What an [`Mlp`]'s last layer is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LastLayer {
    /// A layer like the others, with its activation.
    Activated,
    /// Without activation: its numbers may be any.
    Linear,
    /// The same, of zeros at first: the whole gives 0 until it is trained.
    Zero,
}

/// Linear, activation, Linear, activation, ..; named as a `torch.nn.Sequential` names them:
/// `{name}.0`, `{name}.1`, ..
#[derive(Debug, Clone)]
pub struct Mlp {
    layers: Vec<(Linear, Step)>,
}

/// An activation with its weights.
#[derive(Debug, Clone, Copy)]
enum Step {
    Identity,
    Prelu(BlockId),
    Plu,
    Relu,
}

impl Mlp {
    /// Layers with PReLU, see [`Mlp::with_activation`].
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: &[usize],
        last: LastLayer,
    ) -> Self {
        Self::with_activation(init, name, sizes, Activation::Prelu, last)
    }

    /// Layers from `sizes[0]` to `sizes[1]` to ..: at least two sizes.
    pub fn with_activation<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        sizes: &[usize],
        activation: Activation,
        last: LastLayer,
    ) -> Self {
        let end = sizes.len().saturating_sub(2);
        let layers = sizes
            .windows(2)
            .enumerate()
            .map(|(k, pair)| {
                let layer = format!("{name}.{}", 2 * k);
                let last = if k == end { last } else { LastLayer::Activated };
                let linear = match last {
                    LastLayer::Zero => Linear::of_zeros(init, &layer, pair[0], pair[1]),
                    _ => Linear::new(init, &layer, pair[0], pair[1]),
                };
                let step = match activation {
                    _ if last != LastLayer::Activated => Step::Identity,
                    Activation::Plu => Step::Plu,
                    Activation::Relu => Step::Relu,
                    Activation::Prelu => {
                        let slope = format!("{name}.{}.weight", 2 * k + 1);
                        Step::Prelu(init.constant(slope, &[1], SLOPE).1)
                    }
                };
                (linear, step)
            })
            .collect();
        Self { layers }
    }

    /// `[.., sizes[0]]` -> `[.., last size]`.
    ///
    /// # Errors
    /// An input of another width; no layer.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        mut x: Var,
    ) -> Result<Var, AutogradError> {
        if self.layers.is_empty() {
            let (operation, what) = ("mlp", "it has fewer than two sizes, so no layer");
            return Err(AutogradError::Misplaced { operation, what });
        }
        for (linear, step) in &self.layers {
            x = match *step {
                Step::Relu => linear.forward_relu(tape, x)?,
                _ => linear.forward(tape, x)?,
            };
            match *step {
                Step::Prelu(slope) => {
                    let slope = tape.block(slope);
                    x = tape.prelu(x, slope)?;
                }
                Step::Plu => x = tape.plu(x),
                Step::Identity | Step::Relu => {}
            }
        }
        Ok(x)
    }
}

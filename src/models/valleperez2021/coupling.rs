//! The affine coupling of a block (paper, section 4.2; spec, section 5): the second half of the
//! channels and the latent say how the first half is moved and scaled.

use ndarray::{Array1, Array2, Axis, concatenate, s};
use rand::Rng;

use super::config::ValleperezConfig;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};
use crate::nn::{Initialiser, Place, PositionedSizes, PositionedTransformer, TransformerSizes};

/// What is added to rho tanh(s) before the sigmoid.
const SHIFT: f64 = 2.0;

/// out = [(a + t) scale, b], scale = sigmoid(rho tanh(s) + 2) + 1 - sigmoid(2), (s, t) = net([b, h]).
#[derive(Debug, Clone)]
pub struct AttentionCoupling {
    net: PositionedTransformer,
    /// rho, `[ceil(D / 2)]`.
    rescale: BlockId,
    channels: usize,
}

/// What a coupling gives.
#[derive(Debug, Clone, Copy)]
pub struct Coupled {
    /// `[windows * N, D]`
    pub y: Var,
    /// `[windows * N, ceil(D / 2)]`
    pub scale: Var,
    /// t, likewise.
    pub shift: Var,
}

fn sigmoid(x: f64) -> f64 {
    1.0 / (1.0 + (-x).exp())
}

impl AttentionCoupling {
    /// Adds `{name}.net` and `{name}.rescale`, for D channels and a latent of `latent` numbers.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        config: &ValleperezConfig,
        channels: usize,
        latent: usize,
    ) -> Result<Self, AutogradError> {
        let (changed, kept) = (channels.div_ceil(2), channels / 2);
        let places: Vec<Place> = (0..config.predicted_frames as i64)
            .map(|time| Place { time, modality: 0 })
            .collect();
        let sizes = PositionedSizes {
            inputs: kept + latent,
            outputs: 2 * changed,
            layers: config.coupling_layers,
            layer: TransformerSizes {
                width: config.flow_width,
                heads: config.flow_heads,
                feed_forward: config.flow_feed_forward,
                dropout: 0.0,
            },
            zero_output: config.zero_couplings,
        };
        let net = format!("{name}.net");
        Ok(Self {
            net: PositionedTransformer::new(init, &net, sizes, config.positions, &places)?,
            rescale: init.constant(format!("{name}.rescale"), &[changed], 1.0).1,
            channels,
        })
    }

    fn changed(&self) -> usize {
        self.channels.div_ceil(2)
    }

    /// Scale and shift that the channels `b [windows * N, floor(D / 2)]` and the latent `h` call
    /// for.
    fn scale_and_shift<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        b: Var,
        h: Var,
        frames: usize,
    ) -> Result<(Var, Var), AutogradError> {
        let joined = tape.concat(&[b, h])?;
        let said = self.net.forward(tape, joined, frames)?;
        let s = tape.columns(said, 0..self.changed())?;
        let shift = tape.columns(said, self.changed()..2 * self.changed())?;
        let bounded = tape.tanh(s);
        let rescale = tape.block(self.rescale);
        let logit = tape.mul(bounded, rescale)?;
        let logit = tape.affine(logit, 1.0, SHIFT);
        let scale = tape.sigmoid(logit);
        Ok((tape.affine(scale, 1.0, 1.0 - sigmoid(SHIFT)), shift))
    }

    /// `x [windows * N, D]` and the latent `h [windows * N, latent]`, N = `frames`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        h: Var,
        frames: usize,
    ) -> Result<Coupled, AutogradError> {
        let a = tape.columns(x, 0..self.changed())?;
        let b = tape.columns(x, self.changed()..self.channels)?;
        let (scale, shift) = self.scale_and_shift(tape, b, h, frames)?;
        let moved = tape.add(a, shift)?;
        let scaled = tape.mul(moved, scale)?;
        Ok(Coupled {
            y: tape.concat(&[scaled, b])?,
            scale,
            shift,
        })
    }

    /// x of `y [windows * N, D]`: a = out / scale - t, f64.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn inverse<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        y: &Array2<f64>,
        h: Var,
        frames: usize,
    ) -> Result<Array2<f64>, AutogradError> {
        let changed = self.changed();
        let b = y.slice(s![.., changed..]);
        let kept = tape.constant(b.mapv(T::from_f64));
        let (scale, shift) = self.scale_and_shift(tape, kept, h, frames)?;
        let numbers = |var: Var| {
            let values = tape.values(var).iter().map(|&x| Real::to_f64(x));
            let values = values.collect::<Array1<f64>>();
            values.into_shape_with_order((y.nrows(), changed))
        };
        let refused = |_| AutogradError::Misplaced {
            operation: "coupling",
            what: "its rows are no whole windows",
        };
        let (scale, shift) = (
            numbers(scale).map_err(refused)?,
            numbers(shift).map_err(refused)?,
        );
        let a = &y.slice(s![.., ..changed]) / &scale - &shift;
        concatenate(Axis(1), &[a.view(), b]).map_err(refused)
    }
}

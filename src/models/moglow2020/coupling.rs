//! The affine coupling of a block: an LSTM over time says from the first half of the channels and
//! the condition how the second half is moved and scaled.

use ndarray::{Array2, Axis, concatenate, s};
use rand::Rng;

use super::config::MoglowConfig;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::nn::{Initialiser, Linear, Lstm};

/// What is added to a scale's logit.
const SHIFT: f64 = 2.0;
/// Least scale.
const LEAST: f64 = 1e-6;

/// out = [a, (b + shift) scale], scale = sigmoid(logit + 2) + 1e-6; shift and logit alternate in
/// net([a, condition]).
#[derive(Debug, Clone)]
pub struct LstmCoupling {
    layers: Vec<Lstm>,
    output: Linear,
    channels: usize,
    hidden: usize,
}

/// What a coupling gives.
#[derive(Debug, Clone)]
pub struct Coupled {
    /// `[rows, D]`
    pub y: Var,
    /// `[rows, ceil(D / 2)]`
    pub scale: Var,
    /// States of its layers after the last frame, each `[batch, 2H]`.
    pub states: Vec<Var>,
}

impl LstmCoupling {
    /// Adds `{name}.lstm` and `{name}.output` for D channels and a condition of `condition`
    /// numbers.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        config: &MoglowConfig,
        channels: usize,
        condition: usize,
    ) -> Self {
        let lstm = format!("{name}.lstm");
        let layers = (0..config.lstm_layers).map(|k| {
            let inputs = match k {
                0 => channels / 2 + condition,
                _ => config.hidden,
            };
            Lstm::layer(init, &lstm, k, inputs, config.hidden)
        });
        Self {
            layers: layers.collect(),
            output: Linear::of_zeros(
                init,
                &format!("{name}.output"),
                config.hidden,
                2 * channels.div_ceil(2),
            ),
            channels,
            hidden: config.hidden,
        }
    }

    /// States before the first frame, zeros.
    pub fn start<T: Real>(&self, tape: &mut Tape<'_, T>, batch: usize) -> Vec<Var> {
        let layers = self.layers.iter();
        layers.map(|layer| layer.start(tape, batch)).collect()
    }

    /// The same as arrays.
    pub fn zeros<T: Real>(&self, batch: usize) -> Vec<Array2<T>> {
        let width = 2 * self.hidden;
        self.layers
            .iter()
            .map(|_| Array2::zeros((batch, width)))
            .collect()
    }

    /// Scale and shift, `[rows, ceil(D / 2)]`, for the channels `a [rows, floor(D / 2)]` and the
    /// condition, frame by frame; new states.
    fn scale_and_shift<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        a: Var,
        condition: Var,
        states: &[Var],
    ) -> Result<(Var, Var, Vec<Var>), AutogradError> {
        let mut x = vec![a, condition];
        let mut after = Vec::new();
        for (layer, &state) in self.layers.iter().zip(states) {
            let (outputs, state) = layer.sequence(tape, &x, state)?;
            x = vec![outputs];
            after.push(state);
        }
        let said = self.output.forward(tape, x[0])?;
        let (rows, changed) = (tape.shape(said)[0], self.channels.div_ceil(2));
        let pairs = tape.reshape(said, &[rows * changed, 2])?;
        let mut of_pair = |k: usize| {
            let column = tape.columns(pairs, k..k + 1)?;
            tape.reshape(column, &[rows, changed])
        };
        let (shift, logit) = (of_pair(0)?, of_pair(1)?);
        let logit = tape.affine(logit, 1.0, SHIFT);
        let scale = tape.sigmoid(logit);
        Ok((tape.affine(scale, 1.0, LEAST), shift, after))
    }

    /// `x [frames * batch, D]`, frame by frame, with its condition.
    ///
    /// # Errors
    /// Rows that are no whole frames.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        condition: Var,
        states: &[Var],
    ) -> Result<Coupled, AutogradError> {
        let kept = self.channels / 2;
        let a = tape.columns(x, 0..kept)?;
        let b = tape.columns(x, kept..self.channels)?;
        let (scale, shift, states) = self.scale_and_shift(tape, a, condition, states)?;
        let moved = tape.add(b, shift)?;
        let scaled = tape.mul(moved, scale)?;
        Ok(Coupled {
            y: tape.concat(&[a, scaled])?,
            scale,
            states,
        })
    }

    /// x of one frame `y [batch, D]`, f64, and the states after it.
    ///
    /// # Errors
    /// Another batch.
    pub fn inverse<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        y: &Array2<f64>,
        condition: Var,
        states: &[Var],
    ) -> Result<(Array2<f64>, Vec<Var>), AutogradError> {
        let kept = self.channels / 2;
        let a = y.slice(s![.., ..kept]);
        let given = tape.constant(a.mapv(T::from_f64));
        let (scale, shift, states) = self.scale_and_shift(tape, given, condition, states)?;
        let refused = |_| AutogradError::Misplaced {
            operation: "coupling",
            what: "its rows are no whole frames",
        };
        let numbers = |var: Var| {
            let values = tape.values(var).iter().map(|&x| Real::to_f64(x)).collect();
            Array2::from_shape_vec((y.nrows(), self.channels - kept), values)
        };
        let (scale, shift) = (
            numbers(scale).map_err(refused)?,
            numbers(shift).map_err(refused)?,
        );
        let b = &y.slice(s![.., kept..]) / &scale - &shift;
        let x = concatenate(Axis(1), &[a, b.view()]).map_err(refused)?;
        Ok((x, states))
    }
}

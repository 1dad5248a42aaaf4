//! The network: convolution, Transformer over frames, convolution, added to the interpolation.

use rand::Rng;

use super::Duan2022Settings;
use crate::autograd::{AutogradError, BlockId, Real, Tape, Var};
use crate::models::LossTerms;
use crate::models::rotations::{
    Batch, Body, Prediction, RootSource, RotationNetwork, WindowStatistics,
};
use crate::motion::rotation_window::Interpolation;
use crate::nn::{Convolution, Initialiser, TransformerEncoderLayer, TransformerSizes};

/// Keeps the length of a quaternion of zeros above 0.
const SMALLEST_SQUARE: f64 = 1e-12;

/// Rows are frames, the T frames of a window together. A frame's numbers are the root from R_1 over
/// its deviation in training (3), and quaternions (4 J).
#[derive(Debug, Clone)]
pub struct Duan2022 {
    parents: Vec<Option<usize>>,
    root_deviation: [f64; 3],
    position_deviation: Vec<f64>,
    input: Convolution,
    /// `[T, width]`.
    position: BlockId,
    /// Of a keyframe and of an unknown frame, `[2, width]`.
    keyframe: BlockId,
    layers: Vec<TransformerEncoderLayer>,
    output: Convolution,
    longest: usize,
}

impl Duan2022 {
    /// Adds `input`, `position`, `keyframe`, `layers.{l}`, `output`.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        settings: &Duan2022Settings,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Self, AutogradError> {
        let config = &settings.model;
        let (numbers, width) = (3 + 4 * body.joints(), config.width);
        let longest = settings.schedule.lengths.max;
        let sizes = TransformerSizes {
            width,
            heads: config.heads,
            feed_forward: config.feed_forward,
            dropout: config.dropout,
        };
        let input = Convolution::new(init, "input", (numbers, width), 3)?;
        let (_, position) = init.constant("position".into(), &[longest, width], 0.0);
        let (_, keyframe) = init.constant("keyframe".into(), &[2, width], 0.0);
        let layers = (0..config.layers).map(|l| {
            let layer = TransformerEncoderLayer::new(init, &format!("layers.{l}"), sizes);
            Ok(layer?.with_gelu())
        });
        let layers = layers.collect::<Result<_, AutogradError>>()?;
        let output = match config.zero_decoder {
            true => Convolution::of_zeros(init, "output", (width, numbers), 3)?,
            false => Convolution::new(init, "output", (width, numbers), 3)?,
        };
        Ok(Self {
            parents: body.parents(),
            root_deviation: statistics.root_deviation,
            position_deviation: statistics.position_deviation.clone(),
            input,
            position,
            keyframe,
            layers,
            output,
            longest,
        })
    }

    /// Root over its deviation and quaternions of every frame, `[rows, 3 + 4 J]`.
    ///
    /// # Errors
    /// A batch of another body, or of windows that are too long.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Var, AutogradError> {
        let root = self.divided_root(tape, &batch.root)?;
        let rotations = tape.constant(batch.input.clone());
        let given = tape.concat(&[root, rotations])?;
        let x = self.input.forward(tape, given, batch.frames)?;
        let shape = tape.shape(x).to_vec();
        let position = tape.block(self.position);
        let position = tape.rows(position, 0..batch.frames)?;
        let position = tape.reshape(position, &[1, batch.frames * shape[1]])?;
        let windows = tape.reshape(x, &[batch.windows, batch.frames * shape[1]])?;
        let placed = tape.add(windows, position)?;
        let x = tape.reshape(placed, &shape)?;
        let codes = tape.constant(batch.keyframes.clone());
        let keyframe = tape.block(self.keyframe);
        let known = tape.matmul(codes, keyframe)?;
        let mut x = tape.add(x, known)?;
        for layer in &self.layers {
            x = layer.forward(tape, x, batch.frames)?;
        }
        let residual = self.output.forward(tape, x, batch.frames)?;
        tape.add(given, residual)
    }

    fn divided_root<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        root: &ndarray::Array2<T>,
    ) -> Result<Var, AutogradError> {
        let root = tape.constant(root.clone());
        let inverse = self
            .root_deviation
            .map(|deviation| T::from_f64(1.0 / deviation));
        let inverse = tape.constant_with(&[1, 3], |out| out.copy_from_slice(&inverse));
        tape.mul(root, inverse)
    }

    /// Root in cm, `[rows, 3]`, and quaternions, `[rows, 4 J]`.
    fn parts<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        frames: Var,
    ) -> Result<(Var, Var), AutogradError> {
        let numbers = 3 + 4 * self.parents.len();
        let root = tape.columns(frames, 0..3)?;
        let deviation = self.root_deviation.map(T::from_f64);
        let deviation = tape.constant_with(&[1, 3], |out| out.copy_from_slice(&deviation));
        let root = tape.mul(root, deviation)?;
        Ok((root, tape.columns(frames, 3..numbers)?))
    }

    /// World positions from R_1 over sigma, `[rows, 3 J]`.
    fn divided_positions<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        rotations: Var,
        root: Var,
        offsets: Var,
    ) -> Result<Var, AutogradError> {
        let relative = tape.forward_kinematics(rotations, offsets, &self.parents)?;
        let placed = tape.concat(&vec![root; self.parents.len()])?;
        let positions = tape.add(relative, placed)?;
        let inverse = self
            .position_deviation
            .iter()
            .map(|&sigma| T::from_f64(1.0 / sigma));
        let inverse: Vec<T> = inverse.collect();
        let inverse = tape.constant_with(&[1, inverse.len()], |out| out.copy_from_slice(&inverse));
        tape.mul(positions, inverse)
    }
}

/// Mean absolute difference over the step's windows, their frames and numbers.
fn mean_absolute<T: Real>(
    tape: &mut Tape<'_, T>,
    x: Var,
    target: Var,
    frames: f64,
) -> Result<Var, AutogradError> {
    let numbers = tape.shape(x).last().copied().unwrap_or(1).max(1) as f64;
    let difference = tape.sub(x, target)?;
    let absolute = tape.abs(difference);
    let sum = tape.sum(absolute);
    Ok(tape.affine(sum, 1.0 / (frames * numbers), 0.0))
}

impl<T: Real> RotationNetwork<T> for Duan2022 {
    fn input(&self) -> Interpolation {
        Interpolation::Slerp
    }

    /// Mean absolute errors of quaternions, of the root over its deviation, of world positions over
    /// sigma.
    fn losses(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>) -> Result<LossTerms, AutogradError> {
        let truth = batch.truth.as_ref().ok_or(AutogradError::Misplaced {
            operation: "losses",
            what: "the batch has no truth to compare with",
        })?;
        let frames = (batch.total_windows * batch.frames) as f64;
        let said = self.forward(tape, batch)?;
        let (root, rotations) = self.parts(tape, said)?;
        let true_rotations = tape.constant(truth.rotations.clone());
        let rec = mean_absolute(tape, rotations, true_rotations, frames)?;
        let divided = tape.columns(said, 0..3)?;
        let true_divided = self.divided_root(tape, &truth.root)?;
        let root_term = mean_absolute(tape, divided, true_divided, frames)?;
        let offsets = tape.constant(batch.offsets.clone());
        let unit = tape.normalise(rotations, 4, SMALLEST_SQUARE)?;
        let own = self.divided_positions(tape, unit, root, offsets)?;
        let true_root = tape.constant(truth.root.clone());
        let recorded = self.divided_positions(tape, true_rotations, true_root, offsets)?;
        let position = mean_absolute(tape, own, recorded, frames)?;
        let terms = [
            ("rec", 1.0, rec),
            ("root", 1.0, root_term),
            ("position", 1.0, position),
        ];
        LossTerms::weighted(tape, &terms, None)
    }

    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Prediction, AutogradError> {
        let said = self.forward(tape, batch)?;
        let (root, rotations) = self.parts(tape, said)?;
        Ok(Prediction {
            rotations,
            contacts: None,
            root: Some(root),
        })
    }

    fn root(&self) -> RootSource {
        RootSource::Predicted
    }

    fn needs_contacts(&self) -> bool {
        false
    }

    fn longest(&self) -> usize {
        self.longest
    }
}

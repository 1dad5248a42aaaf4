//! The network and its loss.

use std::f64::consts::LN_2;

use ndarray::Array2;
use rand::Rng;

use super::config::{Head, ValleperezConfig};
use super::encoder::CrossModalEncoder;
use super::flow::{Flow, FlowOutput};
use crate::autograd::{AutogradError, Parameters, Real, Tape, Var, Workspace};
use crate::models::LossTerms;
use crate::models::flow::{Density, LN_TAU, squares_of_windows};
use crate::nn::Initialiser;

/// The network of Valle-Pérez et al. 2021, or its deterministic baseline.
#[derive(Debug, Clone)]
pub struct Valleperez2021 {
    encoder: CrossModalEncoder,
    /// None of the deterministic baseline.
    flow: Option<Flow>,
    hears: bool,
    frames: usize,
    channels: usize,
}

/// Windows beside each other, standardised.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowBatch<T> {
    /// `[windows * motion_context, D]`
    pub motion: Array2<T>,
    /// `[windows * (audio_past + audio_future), A]`
    pub audio: Array2<T>,
    /// What is to be predicted, `[windows * N, D]`.
    pub target: Array2<T>,
    pub windows: usize,
    /// Windows of the whole step, of which these are a part.
    pub total_windows: usize,
}

impl Valleperez2021 {
    /// Adds the encoder's weights and the flow's, for D numbers of motion and A of music a frame;
    /// W of the flow's first block is `first` where it is given.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &ValleperezConfig,
        motion: usize,
        audio: usize,
        first: Option<&Array2<f64>>,
    ) -> Result<Self, AutogradError> {
        Ok(Self {
            encoder: CrossModalEncoder::new(init, config, motion, audio)?,
            flow: match config.head {
                Head::Flow => Some(Flow::new(init, config, motion, config.width, first)?),
                Head::Deterministic => None,
            },
            hears: config.music,
            frames: config.predicted_frames,
            channels: motion,
        })
    }

    /// h, `[windows * N, width]`; of the deterministic baseline the prediction,
    /// `[windows * N, D]`.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn latent<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &WindowBatch<T>,
    ) -> Result<Var, AutogradError> {
        let motion = tape.constant(batch.motion.clone());
        let audio = match self.hears {
            true => tape.constant(batch.audio.clone()),
            false => {
                let shape = batch.audio.shape().to_vec();
                tape.constant_with(&shape, |out| out.fill(T::zero()))
            }
        };
        self.encoder.forward(tape, motion, audio)
    }

    /// The flow's output for the targets of a batch with a latent.
    ///
    /// # Errors
    /// A batch of other sizes; a network without a flow.
    pub fn noise<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &WindowBatch<T>,
        h: Var,
        training: bool,
    ) -> Result<FlowOutput, AutogradError> {
        let x = tape.constant(batch.target.clone());
        self.flow()?.forward(tape, x, h, training)
    }

    /// Whether it samples; else it is the deterministic baseline.
    pub fn is_flow(&self) -> bool {
        self.flow.is_some()
    }

    fn flow(&self) -> Result<&Flow, AutogradError> {
        self.flow.as_ref().ok_or(AutogradError::Misplaced {
            operation: "flow",
            what: "the deterministic baseline has none",
        })
    }

    /// Starts the flow's norms from the first batch.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn start<T: Real>(
        &self,
        parameters: &mut Parameters<T>,
        batch: &WindowBatch<T>,
    ) -> Result<(), AutogradError> {
        let Some(flow) = &self.flow else {
            return Ok(());
        };
        let mut workspace = Workspace::new();
        let mut tape = Tape::inference(parameters, &mut workspace);
        let h = self.latent(&mut tape, batch)?;
        let shape = (tape.shape(h)[0], tape.shape(h)[1]);
        let h = Array2::from_shape_vec(shape, tape.values(h).to_vec());
        drop(tape);
        let h = h.map_err(|_| AutogradError::Misplaced {
            operation: "flow",
            what: "the latent is no matrix",
        })?;
        flow.start(parameters, batch.target.clone(), &h)
    }

    /// -log p of a frame in bits (spec, section 6), and its parts; of the deterministic baseline
    /// the mean squared error (section 8). A part of a step's. In a `training` running statistics
    /// take up the batch first.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn losses<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &WindowBatch<T>,
        training: bool,
    ) -> Result<LossTerms, AutogradError> {
        let h = self.latent(tape, batch)?;
        self.losses_by(tape, batch, h, training)
    }

    /// The same by the latent of the batch.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn losses_by<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &WindowBatch<T>,
        h: Var,
        training: bool,
    ) -> Result<LossTerms, AutogradError> {
        if self.flow.is_none() {
            let target = tape.constant(batch.target.clone());
            let difference = tape.sub(target, h)?;
            let squares = tape.square(difference);
            let sum = tape.sum(squares);
            let numbers = batch.total_windows * self.frames * self.channels;
            let mean = tape.affine(sum, 1.0 / numbers as f64, 0.0);
            return LossTerms::weighted(tape, &[("squared_error", 1.0, mean)], None);
        }
        let output = self.noise(tape, batch, h, training)?;
        // Bits a frame of the step, of a sum over the windows of this part.
        let unit = 1.0 / ((batch.total_windows * self.frames) as f64 * LN_2);
        let density = Density {
            z: output.z,
            norms: output.norms,
            linears: output.linears,
            scales: &output.scales,
            least: output.least,
        };
        let mut losses = density.loss(tape, unit)?;
        losses.buffers = output.buffers;
        Ok(losses)
    }

    /// log p of every window's targets in nats, for all N frames together, by stored statistics; of
    /// the deterministic baseline that of a normal distribution of deviation 1 about its
    /// prediction.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn log_densities<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &WindowBatch<T>,
        h: Var,
    ) -> Result<Vec<f64>, AutogradError> {
        let numbers = self.frames * self.channels;
        let normal = LN_TAU / 2.0 * numbers as f64;
        if self.flow.is_none() {
            let target = tape.constant(batch.target.clone());
            let difference = tape.sub(target, h)?;
            let squares = squares_of_windows(tape.values(difference), numbers);
            return Ok(squares.iter().map(|it| -it / 2.0 - normal).collect());
        }
        let output = self.noise(tape, batch, h, false)?;
        let number = |var: Var| Real::to_f64(tape.values(var)[0]);
        let fixed = self.frames as f64 * (number(output.norms) + number(output.linears));
        let squares = squares_of_windows(tape.values(output.z), numbers);
        let mut densities: Vec<f64> = squares.iter().map(|it| fixed - it / 2.0 - normal).collect();
        let changed = self.frames * self.channels.div_ceil(2);
        for scale in output.scales {
            let windows = tape.values(scale).chunks_exact(changed);
            for (density, scales) in densities.iter_mut().zip(windows) {
                *density += scales.iter().map(|&it| Real::to_f64(it).ln()).sum::<f64>();
            }
        }
        Ok(densities)
    }

    /// The targets that noise `z [windows * N, D]` becomes with a latent, f64; the deterministic
    /// baseline's prediction, whatever the noise.
    ///
    /// # Errors
    /// Noise of other sizes; weights without an inverse.
    pub fn sample<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        z: &Array2<f64>,
        h: Var,
    ) -> Result<Array2<f64>, AutogradError> {
        match &self.flow {
            Some(flow) => flow.inverse(tape, z, h),
            None => {
                let values = tape.values(h).iter().map(|&x| Real::to_f64(x)).collect();
                let shape = (tape.shape(h)[0], self.channels);
                Array2::from_shape_vec(shape, values).map_err(|_| AutogradError::Misplaced {
                    operation: "deterministic",
                    what: "its output has other channels",
                })
            }
        }
    }
}

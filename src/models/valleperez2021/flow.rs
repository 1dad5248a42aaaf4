//! The flow: K blocks of norm, linear and coupling from data to noise (spec, section 5).

use ndarray::Array2;
use rand::Rng;

use super::config::ValleperezConfig;
use super::coupling::AttentionCoupling;
use crate::autograd::{AutogradError, BufferId, Parameters, Real, Tape, Var, Workspace};
use crate::models::flow::{FlowNorm, PluLinear};
use crate::nn::Initialiser;

/// The flow of N frames of D channels.
#[derive(Debug, Clone)]
pub struct Flow {
    blocks: Vec<Block>,
    frames: usize,
}

#[derive(Debug, Clone)]
struct Block {
    norm: FlowNorm,
    linear: PluLinear,
    coupling: AttentionCoupling,
}

/// What the flow makes of a batch.
#[derive(Debug, Clone)]
pub struct FlowOutput {
    /// z, `[windows * N, D]`.
    pub z: Var,
    /// ln |det| of all norms for one frame, `[1]`.
    pub norms: Var,
    /// Of all linear layers for one frame, `[1]`.
    pub linears: Var,
    /// Scales of the couplings, each `[windows * N, ceil(D / 2)]`: the logarithms of a window's add
    /// up to its ln |det|.
    pub scales: Vec<Var>,
    /// New running statistics.
    pub buffers: Vec<(BufferId, Vec<f64>)>,
    /// What each block's norm, linear layer and coupling give, with the coupling's shift.
    pub stages: Vec<[Var; 4]>,
    /// The least logarithm of a factor in the norms, and in the linear layers.
    pub least: [f64; 2],
}

impl Flow {
    /// Adds `flow.blocks.{k}.norm`, `.linear`, `.coupling` for D channels and a latent of `latent`
    /// numbers a frame; W of the first block is `first` where it is given.
    ///
    /// # Errors
    /// Heads that do not divide the width.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &ValleperezConfig,
        channels: usize,
        latent: usize,
        first: Option<&Array2<f64>>,
    ) -> Result<Self, AutogradError> {
        let block = |k: usize| {
            let name = format!("flow.blocks.{k}");
            let matrix = first.filter(|_| k == 0);
            let (norm, linear) = (format!("{name}.norm"), format!("{name}.linear"));
            let coupling = format!("{name}.coupling");
            Ok(Block {
                norm: FlowNorm::new(init, &norm, config.norm, channels),
                linear: PluLinear::new(init, &linear, channels, matrix),
                coupling: AttentionCoupling::new(init, &coupling, config, channels, latent)?,
            })
        };
        let blocks = (0..config.blocks).map(block);
        Ok(Self {
            blocks: blocks.collect::<Result<_, AutogradError>>()?,
            frames: config.predicted_frames,
        })
    }

    /// `x [windows * N, D]` to noise, given `h [windows * N, latent]`.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        h: Var,
        training: bool,
    ) -> Result<FlowOutput, AutogradError> {
        let zero = tape.constant_with(&[1], |out| out.fill(T::zero()));
        let mut output = FlowOutput {
            z: x,
            norms: zero,
            linears: zero,
            scales: Vec::new(),
            buffers: Vec::new(),
            stages: Vec::new(),
            least: [f64::INFINITY; 2],
        };
        for block in &self.blocks {
            block.forward(tape, &mut output, h, self.frames, training)?;
        }
        Ok(output)
    }

    /// Starts the norms, block after block, from a first batch `x [windows * N, D]` with its latent.
    ///
    /// # Errors
    /// Rows that are no whole windows.
    pub fn start<T: Real>(
        &self,
        parameters: &mut Parameters<T>,
        x: Array2<T>,
        h: &Array2<T>,
    ) -> Result<(), AutogradError> {
        let mut workspace = Workspace::new();
        let mut x = x;
        for block in &self.blocks {
            block.norm.start(parameters, &x)?;
            let mut tape = Tape::inference(parameters, &mut workspace);
            let (from, h) = (tape.constant(x.clone()), tape.constant(h.clone()));
            let normed = block.norm.forward(&mut tape, from, false)?;
            let (mixed, _) = block.linear.forward(&mut tape, normed.y)?;
            let coupled = block.coupling.forward(&mut tape, mixed, h, self.frames)?;
            x.iter_mut()
                .zip(tape.values(coupled.y))
                .for_each(|(x, &y)| *x = y);
        }
        Ok(())
    }

    /// x of noise `z [windows * N, D]`, given `h [windows * N, latent]`; what is no network in f64.
    ///
    /// # Errors
    /// Rows that are no whole windows; weights without an inverse.
    pub fn inverse<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        z: &Array2<f64>,
        h: Var,
    ) -> Result<Array2<f64>, AutogradError> {
        let mut x = z.clone();
        for block in self.blocks.iter().rev() {
            x = block.coupling.inverse(tape, &x, h, self.frames)?;
            x = block.linear.inverse(tape, &x)?;
            x = block.norm.inverse(tape, &x)?;
        }
        Ok(x)
    }
}

impl Block {
    fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        so_far: &mut FlowOutput,
        h: Var,
        frames: usize,
        training: bool,
    ) -> Result<(), AutogradError> {
        let normed = self.norm.forward(tape, so_far.z, training)?;
        let (mixed, log_det) = self.linear.forward(tape, normed.y)?;
        let coupled = self.coupling.forward(tape, mixed, h, frames)?;
        so_far.norms = tape.add(so_far.norms, normed.log_det)?;
        so_far.linears = tape.add(so_far.linears, log_det)?;
        so_far.scales.push(coupled.scale);
        let least = [
            self.norm.least_log_scale(tape),
            self.linear.least_log_s(tape),
        ];
        so_far.least = [0, 1].map(|k| so_far.least[k].min(least[k]));
        so_far.buffers.extend(normed.buffers);
        so_far
            .stages
            .push([normed.y, mixed, coupled.y, coupled.shift]);
        so_far.z = coupled.y;
        Ok(())
    }
}

//! The network: K blocks of activation norm, linear and LSTM coupling (Henter et al. 2020,
//! section 4; spec of Valle-Pérez et al., section 8).

use std::f64::consts::LN_2;

use ndarray::Array2;
use rand::Rng;

use super::config::MoglowConfig;
use super::coupling::LstmCoupling;
use crate::autograd::{AutogradError, Parameters, Real, Tape, Var, Workspace};
use crate::models::LossTerms;
use crate::models::flow::{Density, FlowNorm, LN_TAU, NormKind, PluLinear};
use crate::nn::Initialiser;

/// MoGlow.
#[derive(Debug, Clone)]
pub struct Moglow2020 {
    blocks: Vec<Block>,
    channels: usize,
}

#[derive(Debug, Clone)]
struct Block {
    norm: FlowNorm,
    linear: PluLinear,
    coupling: LstmCoupling,
}

/// Sequences beside each other, standardised: row t `sequences` + b is frame t of sequence b.
#[derive(Debug, Clone, PartialEq)]
pub struct SequenceBatch<T> {
    /// What is known of each frame: past motion, then audio around it, each frame by frame,
    /// `[frames * sequences, condition]`.
    pub condition: Array2<T>,
    /// `[frames * sequences, D]`
    pub target: Array2<T>,
    pub sequences: usize,
    /// Sequences of the whole step, of which these are a part.
    pub total_sequences: usize,
}

/// States of the layers of every block, each `[sequences, 2H]`.
pub type States<T> = Vec<Vec<Array2<T>>>;

/// What the flow makes of sequences.
struct Output {
    z: Var,
    /// ln |det| of norms and of linear layers for one frame, `[1]`.
    norms: Var,
    linears: Var,
    scales: Vec<Var>,
    states: Vec<Vec<Var>>,
    /// As in [`Density::least`].
    least: [f64; 2],
}

impl Moglow2020 {
    /// Adds `flow.blocks.{k}.norm`, `.linear`, `.coupling` for D channels and a condition of
    /// `condition` numbers.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        config: &MoglowConfig,
        channels: usize,
        condition: usize,
    ) -> Self {
        let block = |k: usize| {
            let name = format!("flow.blocks.{k}");
            let [norm, linear, coupling] =
                ["norm", "linear", "coupling"].map(|part| format!("{name}.{part}"));
            Block {
                norm: FlowNorm::new(init, &norm, NormKind::Act, channels),
                linear: PluLinear::new(init, &linear, channels, None),
                coupling: LstmCoupling::new(init, &coupling, config, channels, condition),
            }
        };
        Self {
            blocks: (0..config.blocks).map(block).collect(),
            channels,
        }
    }

    fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &SequenceBatch<T>,
    ) -> Result<Output, AutogradError> {
        let zero = tape.constant_with(&[1], |out| out.fill(T::zero()));
        let condition = tape.constant(batch.condition.clone());
        let mut output = Output {
            z: tape.constant(batch.target.clone()),
            norms: zero,
            linears: zero,
            scales: Vec::new(),
            states: Vec::new(),
            least: [f64::INFINITY; 2],
        };
        for block in &self.blocks {
            let normed = block.norm.forward(tape, output.z, false)?;
            let (mixed, log_det) = block.linear.forward(tape, normed.y)?;
            let states = block.coupling.start(tape, batch.sequences);
            let coupled = block.coupling.forward(tape, mixed, condition, &states)?;
            let least = [
                block.norm.least_log_scale(tape),
                block.linear.least_log_s(tape),
            ];
            output.least = [0, 1].map(|k| output.least[k].min(least[k]));
            output.norms = tape.add(output.norms, normed.log_det)?;
            output.linears = tape.add(output.linears, log_det)?;
            output.scales.push(coupled.scale);
            output.states.push(coupled.states);
            output.z = coupled.y;
        }
        Ok(output)
    }

    /// z of sequences, `[frames * sequences, D]`.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn noise<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &SequenceBatch<T>,
    ) -> Result<Array2<f64>, AutogradError> {
        let output = self.forward(tape, batch)?;
        Ok(matrix(tape, output.z).mapv(Real::to_f64))
    }

    /// States before the first frame of as many sequences.
    pub fn start_states<T: Real>(&self, sequences: usize) -> States<T> {
        let blocks = self.blocks.iter();
        blocks
            .map(|block| block.coupling.zeros(sequences))
            .collect()
    }

    /// Starts the norms, block after block, from the first batch.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn start<T: Real>(
        &self,
        parameters: &mut Parameters<T>,
        batch: &SequenceBatch<T>,
    ) -> Result<(), AutogradError> {
        let mut workspace = Workspace::new();
        let mut x = batch.target.clone();
        for block in &self.blocks {
            block.norm.start(parameters, &x)?;
            let mut tape = Tape::inference(parameters, &mut workspace);
            let from = tape.constant(x.clone());
            let condition = tape.constant(batch.condition.clone());
            let normed = block.norm.forward(&mut tape, from, false)?;
            let (mixed, _) = block.linear.forward(&mut tape, normed.y)?;
            let states = block.coupling.start(&mut tape, batch.sequences);
            let coupled = block
                .coupling
                .forward(&mut tape, mixed, condition, &states)?;
            let values = tape.values(coupled.y);
            x.iter_mut().zip(values).for_each(|(x, &y)| *x = y);
        }
        Ok(())
    }

    /// -log p of a frame in bits, and its parts; a part of a step's.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn losses<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &SequenceBatch<T>,
    ) -> Result<LossTerms, AutogradError> {
        let output = self.forward(tape, batch)?;
        let frames = batch.target.nrows() as f64 / batch.sequences.max(1) as f64;
        let density = Density {
            z: output.z,
            norms: output.norms,
            linears: output.linears,
            scales: &output.scales,
            least: output.least,
        };
        density.loss(tape, 1.0 / (batch.total_sequences as f64 * frames * LN_2))
    }

    /// log p of the last `counted` frames of every sequence in nats, and the states behind them.
    ///
    /// # Errors
    /// A batch of other sizes.
    pub fn log_densities<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &SequenceBatch<T>,
        counted: usize,
    ) -> Result<(Vec<f64>, States<T>), AutogradError> {
        let output = self.forward(tape, batch)?;
        let number = |var: Var| Real::to_f64(tape.values(var)[0]);
        let fixed = number(output.norms) + number(output.linears);
        let normal = LN_TAU / 2.0 * self.channels as f64;
        let sequences = batch.sequences;
        let from = (batch.target.nrows() / sequences.max(1)).saturating_sub(counted) * sequences;
        let rows = tape.values(output.z).chunks_exact(self.channels);
        let mut densities = vec![0.0; sequences];
        for (row, z) in rows.enumerate().skip(from) {
            let squares = z.iter().map(|&z| Real::to_f64(z).powi(2)).sum::<f64>();
            densities[row % sequences] += fixed - normal - squares / 2.0;
        }
        for &scale in &output.scales {
            let rows = tape.values(scale).chunks_exact(self.channels.div_ceil(2));
            for (row, scales) in rows.enumerate().skip(from) {
                let logs = scales.iter().map(|&it| Real::to_f64(it).ln());
                densities[row % sequences] += logs.sum::<f64>();
            }
        }
        let of_block = |states: &Vec<Var>| states.iter().map(|&it| matrix(tape, it)).collect();
        let states = output.states.iter().map(of_block).collect();
        Ok((densities, states))
    }

    /// The next frame that noise `z [sequences, D]` becomes under `condition`
    /// `[sequences, condition]`, f64; `states` go on.
    ///
    /// # Errors
    /// Noise of other sizes; weights without an inverse.
    pub fn sample<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        z: &Array2<f64>,
        condition: &Array2<T>,
        states: &mut States<T>,
    ) -> Result<Array2<f64>, AutogradError> {
        let condition = tape.constant(condition.clone());
        let mut x = z.clone();
        for (block, states) in self.blocks.iter().zip(states).rev() {
            let given: Vec<Var> = states.iter().map(|it| tape.constant(it.clone())).collect();
            let (before, after) = block.coupling.inverse(tape, &x, condition, &given)?;
            *states = after.into_iter().map(|it| matrix(tape, it)).collect();
            x = block.linear.inverse(tape, &before)?;
            x = block.norm.inverse(tape, &x)?;
        }
        Ok(x)
    }
}

fn matrix<T: Real>(tape: &Tape<'_, T>, var: Var) -> Array2<T> {
    let columns = tape.shape(var).last().copied().unwrap_or(1).max(1);
    let values = tape.values(var);
    Array2::from_shape_fn((values.len() / columns, columns), |(i, j)| {
        values[i * columns + j]
    })
}

//! The norm of a block, per channel over windows and frames.

use ndarray::{Array1, Array2, ArrayD};
use rand::Rng;
use serde::{Deserialize, Serialize};

use super::prior::least;
use crate::autograd::{AutogradError, BlockId, BufferId, Parameters, Real, Tape, Var};
use crate::nn::Initialiser;

/// What is added to a running deviation.
const EPS: f64 = 1e-5;
/// Share of a running statistic that stays at a step.
const MOMENTUM: f64 = 0.9;
/// Least deviation that the start of an activation norm divides by.
const LEAST_DEVIATION: f64 = 1e-6;

/// How a block normalises.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormKind {
    /// By running statistics: y = (x - mu) e^g / (sqrt(v) + 1e-5) - beta.
    Batch,
    /// By weights that start from the first batch: y = (x + b) e^s.
    Act,
}

/// The norm of a block of D channels.
#[derive(Debug, Clone)]
pub struct FlowNorm {
    /// beta or b, `[D]`.
    bias: BlockId,
    /// g or s, `[D]`.
    log_scale: BlockId,
    /// mu and v of a batch norm, `[D]`.
    running: Option<[BufferId; 2]>,
    names: [String; 2],
}

/// What a norm gives.
#[derive(Debug, Clone)]
pub struct Normed {
    /// `[rows, D]`
    pub y: Var,
    /// ln |dy / dx| of one row, `[1]`.
    pub log_det: Var,
    /// New running statistics.
    pub buffers: Vec<(BufferId, Vec<f64>)>,
}

/// Mean and mean square about it of every column, f64.
fn moments<T: Real>(values: &[T], columns: usize) -> [Vec<f64>; 2] {
    let rows = (values.len() / columns.max(1)).max(1) as f64;
    let mut mean = vec![0.0; columns];
    for row in values.chunks_exact(columns) {
        mean.iter_mut()
            .zip(row)
            .for_each(|(sum, &x)| *sum += Real::to_f64(x));
    }
    mean.iter_mut().for_each(|sum| *sum /= rows);
    let mut square = vec![0.0; columns];
    for row in values.chunks_exact(columns) {
        for ((sum, &x), mean) in square.iter_mut().zip(row).zip(&mean) {
            *sum += (Real::to_f64(x) - mean).powi(2);
        }
    }
    square.iter_mut().for_each(|sum| *sum /= rows);
    [mean, square]
}

impl FlowNorm {
    /// Adds `{name}.beta`, `.log_gamma` and the buffers `.running_mean`, `.running_var`, or
    /// `{name}.bias` and `.log_scale`.
    pub fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        kind: NormKind,
        channels: usize,
    ) -> Self {
        let names = match kind {
            NormKind::Batch => ["beta", "log_gamma"],
            NormKind::Act => ["bias", "log_scale"],
        };
        let names = names.map(|it| format!("{name}.{it}"));
        let [bias, log_scale] = [0, 1].map(|k| init.constant(names[k].clone(), &[channels], 0.0).1);
        let running = matches!(kind, NormKind::Batch).then(|| {
            [("running_mean", 0.0), ("running_var", 1.0)]
                .map(|(it, first)| init.buffer(format!("{name}.{it}"), &[channels], first))
        });
        Self {
            bias,
            log_scale,
            running,
            names,
        }
    }

    /// Sets running statistics, or the weights of an activation norm, from the first batch `x`
    /// `[rows, D]`, so that what comes out has mean 0 and deviation 1.
    ///
    /// # Errors
    /// Parameters of another network.
    pub fn start<T: Real>(
        &self,
        parameters: &mut Parameters<T>,
        x: &Array2<T>,
    ) -> Result<(), AutogradError> {
        let values = x.as_standard_layout();
        let moments = moments(values.as_slice().unwrap_or(&[]), x.ncols());
        if let Some(running) = self.running {
            for (id, values) in running.into_iter().zip(&moments) {
                let mut buffer = parameters.buffer_mut(id)?;
                let values = values.iter().map(|&x| T::from_f64(x)).collect();
                buffer.assign(&Array1::from_vec(values).into_dyn());
            }
            return Ok(());
        }
        let [mean, square] = moments;
        let bias = mean.iter().map(|mean| -mean).collect::<Vec<_>>();
        let logs = square.iter().map(|v| -v.sqrt().max(LEAST_DEVIATION).ln());
        let logs = logs.collect::<Vec<_>>();
        for (name, mut value) in parameters.values_mut() {
            let Some(k) = self.names.iter().position(|own| own == name) else {
                continue;
            };
            let from = if k == 0 { &bias } else { &logs };
            let from: ArrayD<T> =
                Array1::from_iter(from.iter().map(|&x| T::from_f64(x))).into_dyn();
            value.assign(&from);
        }
        Ok(())
    }

    /// What is taken from x and by what it is divided where running statistics say so, and what
    /// they become in a training.
    fn statistics<T: Real>(
        &self,
        tape: &Tape<'_, T>,
        x: Option<Var>,
    ) -> Result<Option<Statistics>, AutogradError> {
        let Some(running) = self.running else {
            return Ok(None);
        };
        let mut now = Vec::new();
        let batch = x.map(|x| {
            let columns = tape.shape(x).last().copied().unwrap_or(1);
            moments(tape.values(x), columns)
        });
        for (k, id) in running.into_iter().enumerate() {
            let stored = tape.buffer(id)?.iter().map(|&x| Real::to_f64(x));
            now.push(match &batch {
                None => stored.collect::<Vec<f64>>(),
                Some(batch) => stored
                    .zip(&batch[k])
                    .map(|(old, new)| MOMENTUM * old + (1.0 - MOMENTUM) * new)
                    .collect(),
            });
        }
        let deviation = now[1].iter().map(|v| v.sqrt() + EPS).collect();
        let buffers = match batch {
            None => Vec::new(),
            Some(_) => running.into_iter().zip(now.clone()).collect(),
        };
        Ok(Some(Statistics {
            mean: now.swap_remove(0),
            deviation,
            buffers,
        }))
    }

    /// `x [rows, D]`, normalised. In a training running statistics take up the batch first.
    ///
    /// # Errors
    /// Other channels.
    pub fn forward<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        x: Var,
        training: bool,
    ) -> Result<Normed, AutogradError> {
        let statistics = self.statistics(tape, training.then_some(x))?;
        let (bias, log_scale) = (tape.block(self.bias), tape.block(self.log_scale));
        let scale = tape.exp(log_scale);
        let log_det = tape.sum(log_scale);
        let Some(statistics) = statistics else {
            let moved = tape.add(x, bias)?;
            let y = tape.mul(moved, scale)?;
            return Ok(Normed {
                y,
                log_det,
                buffers: Vec::new(),
            });
        };
        let mut constant = |values: &mut dyn Iterator<Item = f64>| {
            tape.constant(values.map(T::from_f64).collect::<Array1<T>>())
        };
        let mean = constant(&mut statistics.mean.iter().copied());
        let inverse = constant(&mut statistics.deviation.iter().map(|it| 1.0 / it));
        let moved = tape.sub(x, mean)?;
        let scale = tape.mul(scale, inverse)?;
        let scaled = tape.mul(moved, scale)?;
        let y = tape.sub(scaled, bias)?;
        let logs = statistics.deviation.iter().map(|it| it.ln()).sum::<f64>();
        Ok(Normed {
            y,
            log_det: tape.affine(log_det, 1.0, -logs),
            buffers: statistics.buffers,
        })
    }

    /// The least of g or s.
    pub fn least_log_scale<T: Real>(&self, tape: &mut Tape<'_, T>) -> f64 {
        let log_scale = tape.block(self.log_scale);
        least(tape.values(log_scale))
    }

    /// x of `y [rows, D]` by the stored statistics, f64.
    ///
    /// # Errors
    /// Parameters of another network.
    pub fn inverse<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        y: &Array2<f64>,
    ) -> Result<Array2<f64>, AutogradError> {
        let statistics = self.statistics(tape, None)?;
        let [bias, log_scale] = [self.bias, self.log_scale].map(|id| {
            let values = tape.block(id);
            tape.values(values)
                .iter()
                .map(|&x| Real::to_f64(x))
                .collect::<Array1<f64>>()
        });
        let scale = log_scale.mapv(f64::exp);
        Ok(match statistics {
            None => y / &scale - &bias,
            Some(Statistics {
                mean, deviation, ..
            }) => (y + &bias) / &scale * Array1::from_vec(deviation) + Array1::from_vec(mean),
        })
    }
}

/// Statistics that a batch norm uses.
struct Statistics {
    mean: Vec<f64>,
    /// sqrt(v) + 1e-5.
    deviation: Vec<f64>,
    buffers: Vec<(BufferId, Vec<f64>)>,
}

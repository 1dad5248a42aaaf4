//! How fast two layers of the model are by themselves: forward, a sum of squares, backward, on
//! made-up inputs.

use std::fmt;
use std::time::{Duration, Instant};

use ndarray::{ArrayD, IxDyn};
use rand::{Rng, RngExt, SeedableRng};
use rayon::prelude::*;
use serde::Serialize;

use super::{Initialiser, Linear, Lstm, TransformerEncoderLayer, TransformerSizes};
use crate::autograd::{AutogradError, Gradients, Parameters, Tape, Var, Workspace};
use crate::counted::counted;

/// Sequences or windows in a batch.
const BATCH: usize = 128;
/// Frames of a sequence.
const FRAMES: usize = 30;
/// Tokens of a window.
const TOKENS: usize = 7;

/// What is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// An LSTM 1024 -> 256 and a linear layer to 142, on 128 sequences of 30 frames.
    Lstm,
    /// Two Transformer encoder layers (d 256, 8 heads, feed-forward 256, dropout 0.1) on 128
    /// windows of 7 tokens, with the gradient of their input.
    EncoderLayers,
}

/// Seconds of the fastest of `repetitions` runs, after one to warm up.
///
/// # Errors
/// As `run`.
pub fn fastest<E>(
    repetitions: usize,
    mut run: impl FnMut() -> Result<Duration, E>,
) -> Result<f64, E> {
    run()?;
    let mut seconds = f64::INFINITY;
    for _ in 0..repetitions {
        seconds = seconds.min(run()?.as_secs_f64());
    }
    Ok(seconds)
}

/// Why layers cannot be timed.
#[derive(Debug, thiserror::Error)]
pub enum MeasureError {
    #[error(transparent)]
    Threads(#[from] rayon::ThreadPoolBuildError),
    #[error(transparent)]
    Layers(#[from] AutogradError),
}

/// Speed of the layers, forward and backward: the fastest of the timed steps, ms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LayersSpeed {
    pub threads: usize,
    pub lstm_ms: f64,
    pub encoder_layers_ms: f64,
}

impl LayersSpeed {
    /// Times `repetitions` steps of either after one to warm up.
    ///
    /// # Errors
    /// As [`MeasuredLayers::new`].
    pub fn measure(threads: usize, repetitions: usize) -> Result<Self, MeasureError> {
        let milliseconds = |measured| -> Result<f64, MeasureError> {
            let mut layers = MeasuredLayers::new(measured, threads)?;
            Ok(1e3 * fastest(repetitions, || layers.run())?)
        };
        Ok(Self {
            threads,
            lstm_ms: milliseconds(Measured::Lstm)?,
            encoder_layers_ms: milliseconds(Measured::EncoderLayers)?,
        })
    }
}

impl fmt::Display for LayersSpeed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}: LSTM 1024 -> 256 and linear, 128 x 30: {:.1} ms; two encoder layers, 128 windows \
             of 7: {:.1} ms",
            counted(self.threads, "thread"),
            self.lstm_ms,
            self.encoder_layers_ms
        )
    }
}

enum Layers {
    Lstm { lstm: Lstm, head: Linear },
    Encoder(Box<[TransformerEncoderLayer; 2]>),
}

/// A share of the batch, for one thread.
struct Shard {
    input: ArrayD<f32>,
    workspace: Workspace<f32>,
    gradients: Gradients<f32>,
}

/// Layers whose step can be timed again and again.
pub struct MeasuredLayers {
    layers: Layers,
    parameters: Parameters<f32>,
    shards: Vec<Shard>,
    pool: rayon::ThreadPool,
}

impl MeasuredLayers {
    /// The layers, their batch shared by `threads` threads.
    ///
    /// # Errors
    /// No pool of so many threads to be had.
    pub fn new(measured: Measured, threads: usize) -> Result<Self, MeasureError> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()?;
        let mut parameters = Parameters::new();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let mut init = Initialiser::new(&mut parameters, rng.clone());
        let (layers, shape): (_, fn(usize) -> [usize; 2]) = match measured {
            Measured::Lstm => {
                let lstm = Lstm::new(&mut init, "lstm", 1024, 256);
                let head = Linear::new(&mut init, "head", 256, 142);
                (Layers::Lstm { lstm, head }, |count| [count * FRAMES, 1024])
            }
            Measured::EncoderLayers => {
                let sizes = TransformerSizes {
                    width: 256,
                    heads: 8,
                    feed_forward: 256,
                    dropout: 0.1,
                };
                let mut layer = |name| TransformerEncoderLayer::new(&mut init, name, sizes);
                let layers = [layer("0")?, layer("1")?];
                (Layers::Encoder(Box::new(layers)), |count| {
                    [count * TOKENS, 256]
                })
            }
        };
        let count = threads.clamp(1, BATCH);
        let shards = (0..count)
            .map(|k| Shard {
                input: random(
                    &mut rng,
                    &shape((k + 1) * BATCH / count - k * BATCH / count),
                ),
                workspace: Workspace::new(),
                gradients: Gradients::zeros(&parameters),
            })
            .collect();
        Ok(Self {
            layers,
            parameters,
            shards,
            pool,
        })
    }

    /// Does one step and says how long it took.
    ///
    /// # Errors
    /// None in practice: the shapes fit.
    pub fn run(&mut self) -> Result<Duration, AutogradError> {
        let Self {
            layers,
            parameters,
            shards,
            pool,
        } = self;
        let start = Instant::now();
        // As after an update: weights are packed anew.
        parameters.values_mut().for_each(drop);
        let parameters = &*parameters;
        pool.install(|| {
            shards.par_iter_mut().try_for_each(|shard| {
                shard.gradients.set_zero();
                let tape = Tape::recording(parameters, &mut shard.workspace);
                let mut tape = tape.with_dropout(1);
                let y = layers.forward(&mut tape, &shard.input)?;
                let squares = tape.square(y);
                let loss = tape.sum(squares);
                tape.backward(loss, &mut shard.gradients)
            })
        })?;
        if let Some((first, others)) = shards.split_first_mut() {
            for other in others {
                for (sum, gradient) in first.gradients.iter_mut().zip(other.gradients.iter()) {
                    sum.iter_mut().zip(gradient).for_each(|(sum, &g)| *sum += g);
                }
            }
        }
        Ok(start.elapsed())
    }
}

impl Layers {
    fn forward(&self, tape: &mut Tape<'_, f32>, input: &ArrayD<f32>) -> Result<Var, AutogradError> {
        match self {
            Self::Lstm { lstm, head } => {
                let x = tape.constant(input.clone());
                let count = input.shape()[0] / FRAMES;
                let mut state = lstm.start(tape, count);
                let mut outputs = Vec::new();
                for t in 0..FRAMES {
                    let x = tape.rows(x, t * count..(t + 1) * count)?;
                    let (output, next) = lstm.step(tape, x, state)?;
                    state = next;
                    outputs.push(head.forward(tape, output)?);
                }
                tape.stack(&outputs)
            }
            Self::Encoder(layers) => {
                let mut x = tape.input(input.clone());
                for layer in layers.iter() {
                    x = layer.forward(tape, x, TOKENS)?;
                }
                Ok(x)
            }
        }
    }
}

fn random(rng: &mut impl Rng, shape: &[usize]) -> ArrayD<f32> {
    ArrayD::from_shape_simple_fn(IxDyn(shape), || rng.random_range(-1.0..1.0))
}

//! The training step that `keydance train` runs (whole model, batch 128, own predictions fed back, dropout on, two threads), in
//! frame-steps a second; and two parts of it by themselves, on one thread: an LSTM with a linear layer, two encoder layers.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use keydance::autograd::{AutogradError, Gradients, Parameters, Tape, Workspace};
use keydance::nn::{Initialiser, Linear, Lstm, TransformerEncoderLayer, TransformerSizes};
use keydance::training::ExperimentConfig;
use keydance::training::measure::MeasuredStep;
use ndarray::{ArrayD, IxDyn};
use rand::SeedableRng;

const BATCH: usize = 128;
const THREADS: usize = 2;

fn whole_model(c: &mut Criterion) {
    let mut group = c.benchmark_group("training step");
    group.sample_size(10);
    for frames in [5, 30, 70] {
        let config = ExperimentConfig::default();
        let mut step = MeasuredStep::new(&config, frames, BATCH, THREADS).expect("a valid config");
        group.throughput(Throughput::Elements((frames * BATCH) as u64));
        group.bench_function(BenchmarkId::from_parameter(frames), |bencher| {
            bencher.iter_custom(|iterations| {
                (0..iterations)
                    .map(|_| step.run().expect("finite losses"))
                    .sum::<Duration>()
            });
        });
    }
}

fn random(shape: &[usize]) -> ArrayD<f32> {
    let mut state = 1u32;
    ArrayD::from_shape_simple_fn(IxDyn(shape), || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / 8_388_608.0 - 1.0
    })
}

/// Forward and backward of a sum of squares.
fn step(
    parameters: &Parameters<f32>,
    workspace: &mut Workspace<f32>,
    gradients: &mut Gradients<f32>,
    forward: impl Fn(&mut Tape<'_, f32>) -> Result<keydance::autograd::Var, AutogradError>,
) -> Result<(), AutogradError> {
    gradients.set_zero();
    let mut tape = Tape::recording(parameters, workspace).with_dropout(1);
    let y = forward(&mut tape)?;
    let squares = tape.square(y);
    let loss = tape.sum(squares);
    tape.backward(loss, gradients)
}

fn lstm(c: &mut Criterion) {
    let mut parameters = Parameters::new();
    let rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut init = Initialiser::new(&mut parameters, rng);
    let lstm = Lstm::new(&mut init, "lstm", 1024, 256);
    let head = Linear::new(&mut init, "head", 256, 142);
    let input = random(&[30 * BATCH, 1024]);
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    c.bench_function("LSTM 1024 -> 256 and linear, 128 x 30", |bencher| {
        bencher.iter(|| {
            step(&parameters, &mut workspace, &mut gradients, |tape| {
                let x = tape.constant(input.clone());
                let mut state = lstm.start(tape, BATCH);
                let mut outputs = Vec::new();
                for t in 0..30 {
                    let x = tape.rows(x, t * BATCH..(t + 1) * BATCH)?;
                    let (output, next) = lstm.step(tape, x, state)?;
                    state = next;
                    outputs.push(head.forward(tape, output)?);
                }
                tape.stack(&outputs)
            })
            .expect("shapes fit");
            black_box(&gradients);
        });
    });
}

fn encoder(c: &mut Criterion) {
    let sizes = TransformerSizes {
        width: 256,
        heads: 8,
        feed_forward: 256,
        dropout: 0.1,
    };
    let mut parameters = Parameters::new();
    let rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let mut init = Initialiser::new(&mut parameters, rng);
    let layers = [0, 1].map(|k| TransformerEncoderLayer::new(&mut init, &format!("{k}"), sizes));
    let input = random(&[7 * BATCH, 256]);
    let mut workspace = Workspace::new();
    let mut gradients = Gradients::zeros(&parameters);
    c.bench_function("two encoder layers, 128 windows of 7", |bencher| {
        bencher.iter(|| {
            step(&parameters, &mut workspace, &mut gradients, |tape| {
                let mut x = tape.input(input.clone());
                for layer in &layers {
                    x = layer.forward(tape, x, 7)?;
                }
                Ok(x)
            })
            .expect("shapes fit");
            black_box(&gradients);
        });
    });
}

criterion_group!(benches, whole_model, lstm, encoder);
criterion_main!(benches);

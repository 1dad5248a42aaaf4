//! The training step that `keydance train` runs (whole model, batch 128, own predictions fed back,
//! dropout on, two threads), in frame-steps a second; and two parts of it by themselves, on as many
//! threads: an LSTM with a linear layer, two encoder layers.

use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use keydance::experiment::ExperimentConfig;
use keydance::nn::measure::{Measured, MeasuredLayers};
use keydance::step::measure::MeasuredStep;

const BATCH: usize = 128;
const THREADS: usize = 2;

fn whole_model(c: &mut Criterion) {
    let mut group = c.benchmark_group("training step");
    group.sample_size(10);
    for frames in [5, 30, 70] {
        let config = ExperimentConfig::default();
        let mut step =
            MeasuredStep::new(&config, Some(frames), BATCH, THREADS).expect("a valid config");
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

fn layers(c: &mut Criterion) {
    for (name, measured) in [
        ("LSTM 1024 -> 256 and linear, 128 x 30", Measured::Lstm),
        (
            "two encoder layers, 128 windows of 7",
            Measured::EncoderLayers,
        ),
    ] {
        let mut layers = MeasuredLayers::new(measured, THREADS).expect("a pool of threads");
        c.bench_function(name, |bencher| {
            bencher.iter_custom(|iterations| {
                (0..iterations)
                    .map(|_| layers.run().expect("shapes fit"))
                    .sum::<Duration>()
            });
        });
    }
}

criterion_group!(benches, whole_model, layers);
criterion_main!(benches);

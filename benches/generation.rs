//! Generation of transitions by the whole model, in frames a second: batch 1 on one thread, batch
//! 64 on two.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use keydance::models::transition::ModelConfig;
use keydance::models::transition::measure::MeasuredGeneration;

const FRAMES: usize = 60;

fn generation(c: &mut Criterion) {
    let mut group = c.benchmark_group("generation");
    group.sample_size(10);
    for (batch, threads) in [(1, 1), (64, 2)] {
        let config = ModelConfig::default();
        let mut generation =
            MeasuredGeneration::new(&config, FRAMES, batch, threads).expect("a valid config");
        group.throughput(Throughput::Elements((FRAMES * batch) as u64));
        group.bench_function(format!("batch {batch}, {threads} threads"), |bencher| {
            bencher.iter_custom(|iterations| {
                (0..iterations)
                    .map(|_| generation.run().expect("shapes fit"))
                    .sum::<Duration>()
            });
        });
    }
}

criterion_group!(benches, generation);
criterion_main!(benches);

//! `keydance bench-generate`: how fast frames are generated on this machine.

use std::time::Instant;

use anyhow::anyhow;
use clap::Args;
use ndarray::Array3;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;

use crate::autograd::{Parameters, Tape, Workspace};
use crate::data::Standardisation;
use crate::models::ModelConfig;
use crate::motion::features::FEATURES;
use crate::nn::Initialiser;

/// Frames of the generated transitions.
const FRAMES: usize = 60;

/// What is timed.
#[derive(Debug, Args)]
pub struct BenchGenerateArgs {
    /// Transitions generated at once
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Threads that share the batch
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Timed generations; the fastest counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    repetitions: u16,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// Times the generation of transitions of 60 frames by the paper's whole model, without a tape that records.
///
/// # Errors
/// No threads to be had.
pub fn run(args: BenchGenerateArgs) -> anyhow::Result<()> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let standardisation = Standardisation {
        mean: vec![0.0; FEATURES],
        std: vec![1.0; FEATURES],
        position_scale: 1.0,
        velocity_scale: 1.0,
    };
    let mut parameters = Parameters::<f32>::new();
    let mut init = Initialiser::new(&mut parameters, rng.clone());
    let network = ModelConfig::default().build(&mut init, &standardisation)?;
    let (batch, threads) = (usize::from(args.batch), usize::from(args.threads));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()?;
    let parts = threads.min(batch);
    let mut shards: Vec<(Array3<f32>, Workspace<f32>)> = (0..parts)
        .map(|k| {
            let windows = (k + 1) * batch / parts - k * batch / parts;
            let features = Array3::from_shape_simple_fn((FRAMES + 1, windows, FEATURES), || {
                rng.random_range(-1.0..1.0)
            });
            (features, Workspace::new())
        })
        .collect();
    let mut seconds = f64::INFINITY;
    for repetition in 0..=args.repetitions {
        let start = Instant::now();
        pool.install(|| {
            shards.par_iter_mut().try_for_each(|(features, workspace)| {
                let mut tape = Tape::inference(&parameters, workspace);
                network.predict(&mut tape, features).map(|_| ())
            })
        })
        .map_err(|error| anyhow!(error))?;
        if repetition > 0 {
            seconds = seconds.min(start.elapsed().as_secs_f64());
        }
    }
    let ms_per_frame = seconds * 1e3 / FRAMES as f64;
    let frames_per_second = (FRAMES * batch) as f64 / seconds;
    if args.json {
        let result = serde_json::json!({
            "batch": batch,
            "threads": threads,
            "ms_per_frame": ms_per_frame,
            "frames_per_second": frames_per_second,
        });
        println!("{result}");
    } else {
        println!(
            "generation, {batch} at once, {threads} threads: {ms_per_frame:.2} ms a frame, {frames_per_second:.0} frames/s"
        );
    }
    Ok(())
}

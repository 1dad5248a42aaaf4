//! `keydance bench-generate`: how fast frames are generated on this machine.

use std::io::Write as _;

use clap::Args;

use crate::models::transition::ModelConfig;
use crate::models::transition::measure::MeasuredGeneration;

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

/// Times the generation of transitions of 60 frames by the paper's whole model, without a tape that
/// records.
///
/// # Errors
/// No threads to be had.
pub fn run(args: BenchGenerateArgs) -> anyhow::Result<()> {
    let (batch, threads) = (usize::from(args.batch), usize::from(args.threads));
    let mut generation = MeasuredGeneration::new(&ModelConfig::default(), FRAMES, batch, threads)?;
    generation.run()?;
    let mut seconds = f64::INFINITY;
    for _ in 0..args.repetitions {
        seconds = seconds.min(generation.run()?.as_secs_f64());
    }
    let ms_per_frame = seconds * 1e3 / FRAMES as f64;
    let frames_per_second = (FRAMES * batch) as f64 / seconds;
    let mut out = std::io::stdout();
    if args.json {
        let result = serde_json::json!({
            "batch": batch,
            "threads": threads,
            "ms_per_frame": ms_per_frame,
            "frames_per_second": frames_per_second,
        });
        writeln!(out, "{result}")?;
    } else {
        writeln!(
            out,
            "generation, {batch} at once, {threads} threads: {ms_per_frame:.2} ms a frame, {frames_per_second:.0} frames/s"
        )?;
    }
    Ok(())
}

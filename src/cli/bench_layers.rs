//! `keydance bench-layers`: how fast an LSTM and two Transformer encoder layers are on this
//! machine.

use std::io::Write as _;

use clap::Args;

use crate::nn::measure::{Measured, MeasuredLayers};

/// What is timed.
#[derive(Debug, Args)]
pub struct BenchLayersArgs {
    /// Threads that share the batch
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=128))]
    threads: u16,
    /// Timed steps; the fastest counts
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    repetitions: u16,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// Times forward and backward of the model's layers by themselves.
///
/// # Errors
/// No threads to be had.
pub fn run(args: BenchLayersArgs) -> anyhow::Result<()> {
    let milliseconds = |measured| -> anyhow::Result<f64> {
        let mut layers = MeasuredLayers::new(measured, args.threads.into())?;
        layers.run()?;
        let mut best = f64::INFINITY;
        for _ in 0..args.repetitions {
            best = best.min(layers.run()?.as_secs_f64() * 1e3);
        }
        Ok(best)
    };
    let lstm = milliseconds(Measured::Lstm)?;
    let encoder = milliseconds(Measured::EncoderLayers)?;
    let mut out = std::io::stdout();
    if args.json {
        let result = serde_json::json!({
            "threads": args.threads,
            "lstm_ms": lstm,
            "encoder_layers_ms": encoder,
        });
        writeln!(out, "{result}")?;
    } else {
        writeln!(
            out,
            "{} threads: LSTM 1024 -> 256 and linear, 128 x 30: {lstm:.1} ms; two encoder layers, 128 windows of 7: {encoder:.1} ms",
            args.threads
        )?;
    }
    Ok(())
}

//! `keydance bench-step`, `bench-layers`, `bench-generate`: how fast this machine computes.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::counted::counted;
use crate::experiment::ExperimentConfig;
use crate::models::transition::ModelConfig;
use crate::models::transition::measure::MeasuredGeneration;
use crate::nn::measure::{Measured, MeasuredLayers, fastest};
use crate::training::measure::step_speed;

/// Frames of the generated transitions.
const FRAMES: usize = 60;

/// What is timed.
#[derive(Debug, Args)]
pub struct StepArgs {
    /// Config of an experiment; without one, the first paper's whole model
    config: Option<PathBuf>,
    /// Override a key of the config; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Frames of a transition
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u16).range(1..))]
    frames: u16,
    /// Windows in the batch
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Parts that the batch is computed in [default: the paper config's]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    shards: Option<u16>,
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: u16,
    /// Timed steps; the fastest counts
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    repetitions: u16,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
}

/// What is timed.
#[derive(Debug, Args)]
pub struct LayersArgs {
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

/// What is timed.
#[derive(Debug, Args)]
pub struct GenerateArgs {
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

/// Times the step of a config's model.
///
/// # Errors
/// The config cannot be used, or no threads are to be had.
pub fn step(args: StepArgs) -> anyhow::Result<()> {
    let mut sets = args.set;
    sets.extend(args.shards.map(|it| format!("schedule.shards={it}")));
    let config = match &args.config {
        Some(path) => ExperimentConfig::load(path, &sets)?,
        None => ExperimentConfig::with_sets(&sets)?,
    };
    let speed = step_speed(
        &config,
        args.frames.into(),
        args.batch.into(),
        args.threads.into(),
        args.repetitions.into(),
    )?;
    print(args.json, &speed, &speed.to_string())
}

/// Times forward and backward of the model's layers by themselves.
///
/// # Errors
/// No threads to be had.
pub fn layers(args: LayersArgs) -> anyhow::Result<()> {
    let threads = args.threads;
    let milliseconds = |measured| -> anyhow::Result<f64> {
        let mut layers = MeasuredLayers::new(measured, threads.into())?;
        Ok(1e3 * fastest(args.repetitions.into(), || layers.run())?)
    };
    let lstm = milliseconds(Measured::Lstm)?;
    let encoder = milliseconds(Measured::EncoderLayers)?;
    let result = serde_json::json!({
        "threads": threads,
        "lstm_ms": lstm,
        "encoder_layers_ms": encoder,
    });
    let text = format!(
        "{}: LSTM 1024 -> 256 and linear, 128 x 30: {lstm:.1} ms; two encoder \
         layers, 128 windows of 7: {encoder:.1} ms",
        counted(threads, "thread")
    );
    print(args.json, &result, &text)
}

/// Times the generation of transitions of 60 frames by the paper's whole model, without a tape that
/// records.
///
/// # Errors
/// No threads to be had.
pub fn generate(args: GenerateArgs) -> anyhow::Result<()> {
    let (batch, threads) = (usize::from(args.batch), usize::from(args.threads));
    let mut generation = MeasuredGeneration::new(&ModelConfig::default(), FRAMES, batch, threads)?;
    let seconds = fastest(args.repetitions.into(), || generation.run())?;
    let ms_per_frame = seconds * 1e3 / FRAMES as f64;
    let frames_per_second = (FRAMES * batch) as f64 / seconds;
    let result = serde_json::json!({
        "batch": batch,
        "threads": threads,
        "ms_per_frame": ms_per_frame,
        "frames_per_second": frames_per_second,
    });
    let text = format!(
        "generation, {batch} at once, {}: {ms_per_frame:.2} ms a frame, \
         {frames_per_second:.0} frames/s",
        counted(threads, "thread")
    );
    print(args.json, &result, &text)
}

/// Prints a result as a line of JSON or as text.
fn print(json: bool, result: &impl Serialize, text: &str) -> anyhow::Result<()> {
    let json = json.then(|| serde_json::to_string(result)).transpose()?;
    writeln!(std::io::stdout(), "{}", json.as_deref().unwrap_or(text))?;
    Ok(())
}

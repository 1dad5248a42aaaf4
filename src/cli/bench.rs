//! `keydance bench-step`, `bench-layers`, `bench-generate`: how fast this machine computes.

use std::fmt::Display;
use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::notice::out;
use crate::experiment::ExperimentConfig;
use crate::models::transition::measure::GenerationSpeed;
use crate::nn::measure::LayersSpeed;
use crate::ranks;
use crate::step::measure::step_speed;

/// What is timed.
#[derive(Debug, Args)]
pub struct StepArgs {
    /// Config of an experiment; without one, the first paper's whole model
    config: Option<PathBuf>,
    /// Override a key of the config; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Frames of a window [default: 30 of a transition, else the config's]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    frames: Option<u16>,
    /// Windows in the batch
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u16).range(1..))]
    batch: u16,
    /// Parts that the batch is computed in [default: the config's]
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
    let (frames, batch) = (args.frames.map(usize::from), args.batch.into());
    let (threads, repetitions) = (args.threads.into(), args.repetitions.into());
    print(
        args.json,
        &step_speed(
            &config,
            frames,
            batch,
            threads,
            repetitions,
            ranks::join("bench-step")?,
        )?,
    )
}

/// Times forward and backward of the model's layers by themselves.
///
/// # Errors
/// No threads to be had.
pub fn layers(args: LayersArgs) -> anyhow::Result<()> {
    let speed = LayersSpeed::measure(args.threads.into(), args.repetitions.into())?;
    print(args.json, &speed)
}

/// Times the generation of transitions by the paper's whole model, without a tape that records.
///
/// # Errors
/// No threads to be had.
pub fn generate(args: GenerateArgs) -> anyhow::Result<()> {
    let (batch, threads) = (args.batch.into(), args.threads.into());
    let speed = GenerationSpeed::measure(batch, threads, args.repetitions.into())?;
    print(args.json, &speed)
}

/// Prints a speed as a line of JSON or as text.
fn print(json: bool, speed: &(impl Serialize + Display)) -> anyhow::Result<()> {
    let line = match json {
        true => serde_json::to_string(speed)?,
        false => speed.to_string(),
    };
    Ok(writeln!(out(), "{line}")?)
}

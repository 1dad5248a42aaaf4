//! `keydance bench-step`: how fast a training step is on this machine.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::experiment::ExperimentConfig;
use crate::training::measure::step_speed;

/// What is timed.
#[derive(Debug, Args)]
pub struct BenchStepArgs {
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

/// Times the step of the paper's whole model.
///
/// # Errors
/// No threads to be had.
pub fn run(args: BenchStepArgs) -> anyhow::Result<()> {
    let mut sets = args.set;
    sets.extend(
        args.shards
            .map(|shards| format!("schedule.shards={shards}")),
    );
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
    let mut out = std::io::stdout();
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&speed)?)?;
    } else {
        writeln!(
            out,
            "training step, {} windows of {} frames, {} threads: {:.3} s, {:.0} frame-steps/s",
            speed.batch, speed.frames, speed.threads, speed.seconds, speed.frame_steps_per_second
        )?;
    }
    Ok(())
}

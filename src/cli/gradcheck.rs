//! `keydance gradcheck`: a model's gradient against central differences, in f64.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::experiment::ExperimentConfig;
use crate::models::gradient_report::GradientReport;
use crate::models::settings::GradientCheckOptions;

#[derive(Debug, Args)]
pub struct GradcheckArgs {
    /// Experiment whose model is checked, such as experiments/pan2021/one_lstm.toml; without one,
    /// the whole model
    config: Option<PathBuf>,
    /// Override a value of the config, such as model.loss.key=0
    #[arg(long, value_name = "KEY=VALUE", requires = "config")]
    set: Vec<String>,
    /// Frames to predict, instead of 12 and 6
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1000))]
    frames: Option<u16>,
    /// Windows in the batch
    #[arg(long, value_name = "B", default_value_t = 2, value_parser = clap::value_parser!(u16).range(1..=1000))]
    windows: u16,
    /// Most numbers of each parameter that are compared
    #[arg(long, value_name = "K", default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..))]
    per_parameter: u32,
    /// Seed of motion and weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Keep the model's sizes instead of small ones (slow)
    #[arg(long)]
    full_size: bool,
}

/// # Errors
/// The config cannot be read or has nothing to train; a gradient is wrong, or too many numbers
/// could not be compared.
pub fn run(args: GradcheckArgs) -> anyhow::Result<()> {
    let experiment = match &args.config {
        Some(path) => ExperimentConfig::load(path, &args.set)?,
        None => ExperimentConfig::default(),
    };
    let options = GradientCheckOptions {
        frames: args.frames.map(usize::from),
        full_size: args.full_size,
        windows: args.windows.into(),
        per_parameter: args.per_parameter as usize,
        seed: args.seed,
    };
    let report = GradientReport::of(&*experiment.model, &options)?;
    write!(std::io::stdout(), "{report}")?;
    Ok(report.verdict()?)
}

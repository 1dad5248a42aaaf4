//! `keydance gradcheck`: a model's gradient against central differences, in f64.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;
use rayon::prelude::*;

use crate::autograd::check::{CheckReport, ParameterReport};
use crate::experiment::ExperimentConfig;
use crate::models::transition::Feed;
use crate::models::transition::gradient_check::{GradientCase, GradientCheckConfig, check_model};

/// Largest error that passes.
const TOLERANCE: f64 = 1e-5;
/// Largest share of numbers that may stand at a kink.
const MOST_KINKS: f64 = 0.02;
/// Transitions with more and with fewer frames than two times m = 5 (the two cases of eq. 10).
const TRANSITIONS: [usize; 2] = [12, 6];

#[derive(Debug, Args)]
pub struct GradcheckArgs {
    /// Experiment whose model is checked, such as experiments/pan2021/one_lstm.toml; without one, the whole model
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
    #[arg(long, value_name = "K", default_value_t = 5)]
    per_parameter: usize,
    /// Seed of motion and weights
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Keep the model's sizes instead of small ones (slow)
    #[arg(long)]
    full_size: bool,
}

/// # Errors
/// The config cannot be read or has nothing to train; a gradient is wrong, or too many numbers could not be compared.
pub fn run(args: GradcheckArgs) -> anyhow::Result<()> {
    let experiment = match &args.config {
        Some(path) => ExperimentConfig::load(path, &args.set)?,
        None => ExperimentConfig::default(),
    };
    let model = if args.full_size {
        experiment.model
    } else {
        experiment.model.small()
    };
    let config = GradientCheckConfig {
        windows: args.windows.into(),
        per_parameter: args.per_parameter,
        seed: args.seed,
    };
    let cases = cases(args.frames.map(usize::from));
    let reports = cases
        .par_iter()
        .map(|&case| check_model(&model, case, config))
        .collect::<Result<Vec<_>, _>>()?;
    let reports: Vec<_> = cases
        .iter()
        .zip(reports)
        .filter_map(|(case, report)| Some((case, report?)))
        .collect();
    let mut out = std::io::stdout().lock();
    for (case, report) in &reports {
        writeln!(out, "{}", title(case))?;
        write!(out, "{}", table(report))?;
        writeln!(out)?;
    }
    let reports = || reports.iter().map(|(_, report)| report);
    let error = reports().map(CheckReport::error).fold(0.0, f64::max);
    let compared: usize = reports().map(CheckReport::compared).sum();
    let kinks: usize = reports().map(CheckReport::kinks).sum();
    writeln!(
        out,
        "{compared} numbers compared, {kinks} at kinks left out; largest error {error:.1e}"
    )?;
    if error > TOLERANCE {
        bail!("a gradient is wrong: its error {error:.1e} is above {TOLERANCE:.0e}");
    }
    let drawn = compared + kinks;
    if drawn == 0 || kinks as f64 > MOST_KINKS * drawn as f64 {
        bail!(
            "too little was compared: {kinks} of {drawn} numbers stand at a kink; another --seed may draw better ones"
        );
    }
    Ok(())
}

fn cases(frames: Option<usize>) -> Vec<GradientCase> {
    let transitions = frames.map_or(TRANSITIONS.to_vec(), |frames| vec![frames]);
    let mut cases = Vec::new();
    for transition in transitions {
        for feed in [Feed::Predictions, Feed::GroundTruth] {
            for dropout in [false, true] {
                cases.push(GradientCase {
                    transition,
                    feed,
                    dropout,
                });
            }
        }
    }
    cases
}

fn title(case: &GradientCase) -> String {
    let feed = match case.feed {
        Feed::GroundTruth => "the truth fed",
        Feed::Predictions => "own predictions fed",
    };
    let dropout = if case.dropout { "on" } else { "off" };
    format!("N = {}, {feed}, dropout {dropout}", case.transition)
}

/// A row for each part of the network: what its parameters' names begin with.
fn table(report: &CheckReport) -> String {
    let mut groups: Vec<(&str, Vec<&ParameterReport>)> = Vec::new();
    for parameter in &report.parameters {
        let group = parameter.parameter.split('.').next().unwrap_or_default();
        match groups.iter_mut().find(|(name, _)| *name == group) {
            Some((_, members)) => members.push(parameter),
            None => groups.push((group, vec![parameter])),
        }
    }
    let mut text = format!(
        "  {:<28} {:>8} {:>6} {:>9}  {}\n",
        "part", "compared", "kinks", "error", "where"
    );
    for (group, members) in groups {
        let compared: usize = members.iter().map(|p| p.compared).sum();
        let kinks: usize = members.iter().map(|p| p.kinks).sum();
        let worst = members
            .iter()
            .filter_map(|p| p.worst.as_ref().map(|worst| (p, worst)))
            .max_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
        let (error, place) = match worst {
            Some((parameter, worst)) => (
                format!("{:.1e}", worst.error),
                format!(
                    "{}[{}]: gradient {:.8e}, difference {:.8e}",
                    parameter.parameter, worst.index, worst.analytic, worst.numeric
                ),
            ),
            None => ("-".into(), "-".into()),
        };
        text += &format!("  {group:<28} {compared:>8} {kinks:>6} {error:>9}  {place}\n");
    }
    text
}

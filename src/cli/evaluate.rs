//! `keydance evaluate`: reads a run's folder (or the config of a model that needs no training) and
//! a data folder, writes scores.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::list::{name, within};
use super::notice::warn;
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::data::{DataPart, Dataset};
use crate::evaluation::EvaluationOptions;
use crate::experiment::{Scoring, ScoringChoice};
use crate::run::{Subject, check_outputs_beside};

#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// Folder of a run, or the config of a model that needs no training
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: PathBuf,
    /// Folder of BVH files, or what prepare made of one; the config says which of them train,
    /// validate and test
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Which clips to score on
    #[arg(long, value_enum, default_value_t)]
    clips: DataPart,
    /// Transition lengths N to score at, frames, instead of the protocol's own, such as 10, 50, 100
    /// and 150; AVG is the mean over these
    #[arg(long, value_name = "N,N", value_delimiter = ',', allow_hyphen_values = true,
        value_parser = within(1..=10_000u16))]
    lengths: Vec<u16>,
    /// Score at most this many windows of each length, spread evenly over all: cheap, and not
    /// comparable with scores on all of them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    windows: Option<u32>,
    /// Ways of counting to score by, instead of all that the tables of the model's paper have (they
    /// are listed below)
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = name)]
    protocol: Vec<String>,
    /// Write the scores here, too; a run's folder gets those of its own model by all protocols, on
    /// all windows of the paper's lengths anyway, as evaluation.json (evaluation_validation.json,
    /// evaluation_train.json)
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// For a config: a folder for config and scores, which `keydance tables` reads like a run's
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Override a key of the config, such as data.split.share=0.8; of a run's model only
    /// model.velocity_refinement; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Evaluate on other data than the run was trained on, or split otherwise; the run keeps such
    /// scores with --force only
    #[arg(long)]
    other_data: bool,
    /// Replace files, and scores on other clips, that are there already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// The run, its weights or the data cannot be used, or do not fit each other; nothing is written
/// then. A file cannot be written.
pub fn run(args: EvaluateArgs) -> anyhow::Result<ExitCode> {
    let mut subject = Subject::open(&args.run, &args.set)?;
    let own = subject.files();
    let inputs = own.iter().chain([&args.data]);
    check_outputs_beside(args.out.as_deref(), &args.json, inputs, args.force)?;
    let dataset = Dataset::load(&args.data, &subject.config.data)?;
    warn(&dataset.warnings);
    let own_data = subject.check_data(&dataset, &args.data);
    let own_data = match args.other_data {
        true => own_data.is_ok(),
        false => own_data.map(|()| true)?,
    };
    subject.model.look_up_in(&dataset.train)?;
    let lengths = BTreeSet::from_iter(args.lengths.into_iter().map(usize::from));
    let choice = ScoringChoice {
        part: args.clips,
        options: EvaluationOptions {
            lengths: lengths.into_iter().collect(),
            most_windows: args.windows.map(|most| most as usize),
        },
        protocols: args.protocol,
        out: args.out,
        own_data,
        force: args.force,
    };
    let scoring = Scoring::new(&subject, &dataset, &choice)?;
    warn(scoring.warning());
    let mut out = std::io::stdout();
    writeln!(out, "{}\n", scoring.title())?;
    let farewell = format!(
        "stopped, nothing is written; begin again with\n  {}",
        command()
    );
    let (pool, stop) = (args.threads.pool()?, Stop::on_signal(farewell)?);
    let (model, part) = (&*subject.model, args.clips);
    let evaluated = scoring.record(|protocol| {
        let watched = || evaluate_watched(protocol, model, &dataset, part, true, Some(&stop));
        let evaluation = pool.install(watched)?;
        warn(&evaluation.warnings);
        Ok(evaluation.scores)
    });
    let record = match evaluated {
        Err(error) if error.is_stopped() => return Ok(interrupted(&stop.farewell)),
        evaluated => evaluated?,
    };
    write!(out, "{}", scoring.terminal(&record)?)?;
    // Where one cannot be written, the other is there.
    let kept = scoring.keep(&record);
    if let Some(path) = &args.json {
        record.write_scores(path)?;
    }
    kept?;
    Ok(ExitCode::SUCCESS)
}

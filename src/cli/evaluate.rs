//! `keydance evaluate`: reads a run's folder (or the config of a model that needs no training) and
//! a data folder, writes scores.

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use super::clip_choice::ClipChoice;
use super::list::{name, within};
use super::notice::warn;
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::evaluation::protocol::choose;
use crate::evaluation::{
    EvaluatedData, EvaluationOptions, EvaluationRecord, ProtocolScores, TableRow, Tables,
};
use crate::run::{Subject, check_outputs_beside};

#[derive(Debug, Args)]
pub struct EvaluateArgs {
    /// Folder of a run, or the config of a model that needs no training
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: PathBuf,
    /// Folder of BVH files; the config says which of them train, validate and test
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Which clips to score on
    #[arg(long, value_enum, default_value_t)]
    clips: ClipChoice,
    /// Transition lengths N to score at, frames, instead of the protocol's own, such as 10, 50, 100
    /// and 150; AVG is the mean over these
    #[arg(long, value_name = "N,N", value_delimiter = ',', allow_hyphen_values = true,
        value_parser = within(1..=10_000u16))]
    lengths: Vec<u16>,
    /// Score at most this many windows of each length, spread evenly over all: cheap, and not
    /// comparable with scores on all of them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    windows: Option<u32>,
    /// Ways of counting to score by, instead of all that the model's paper has (they are listed
    /// below)
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
    /// Evaluate on other data than the run was trained on, or split otherwise
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
    let subject = Subject::open(&args.run, &args.set)?;
    let own = subject.files();
    let inputs = own.iter().chain([&args.data]);
    check_outputs_beside(args.out.as_deref(), &args.json, inputs, args.force)?;
    let dataset = Dataset::load(&args.data, &subject.config.data)?;
    warn(&dataset.warnings);
    if !args.other_data {
        subject.check_data(&dataset, &args.data)?;
    }
    let mut out = std::io::stdout();
    let part = DataPart::from(args.clips);
    let mut data = EvaluatedData::of(&dataset, part)?;
    let folder = subject.scores_folder(args.out.as_deref(), &data, args.force)?;
    if subject.run.is_some() && folder.is_none() {
        warn(["the run keeps its scores on other clips; --force replaces them"]);
    }
    let clips = counted(data.clips, &format!("{} clip", data.part));
    writeln!(out, "{} on {clips}, {} frames\n", subject.what, data.frames)?;
    let config = &subject.config;
    let lengths = BTreeSet::from_iter(args.lengths.iter().map(|&length| length.into()));
    let options = EvaluationOptions {
        lengths: lengths.into_iter().collect(),
        most_windows: args.windows.map(|most| most as usize),
    };
    let protocols = config.protocols_with(&options);
    let protocols = choose(protocols, &args.protocol, !args.lengths.is_empty())?;
    let farewell = format!(
        "stopped, nothing is written; begin again with\n  {}",
        command()
    );
    let (pool, stop) = (args.threads.pool()?, Stop::on_signal(farewell)?);
    let model = &*subject.model;
    let mut scores = Vec::new();
    for protocol in &protocols {
        let evaluation = match pool
            .install(|| evaluate_watched(&**protocol, model, &dataset, part, true, Some(&stop)))
        {
            Err(error) if error.is_stopped() => {
                return Ok(interrupted(&stop.farewell));
            }
            evaluation => evaluation?,
        };
        warn(&evaluation.warnings);
        scores.push((protocol.name(), evaluation.scores));
    }
    let scores = ProtocolScores::new(scores);
    let row = TableRow {
        name: config.name.clone(),
        seed: None,
        scores: Some(scores.clone()),
        schedule_note: String::new(),
    };
    let (protocols, printed) = (&protocols, &config.printed()?);
    write!(out, "{}", Tables { protocols, printed }.terminal(&[row]))?;
    if let Some(most) = args.windows {
        writeln!(
            out,
            "\nat most {most} windows of each length: not comparable with scores on all"
        )?;
    }
    let bound = options.most_windows;
    data.most_windows = bound.filter(|&most| scores.most_windows() >= most);
    let record = EvaluationRecord { scores, data };
    let all = args.lengths.is_empty() && args.windows.is_none() && args.protocol.is_empty();
    let of_its_own = match &subject.run {
        Some(run) => all && *run.config()?.model == *subject.config.model,
        None => true,
    };
    if let Some(folder) = folder.filter(|_| of_its_own) {
        subject.write_scores(folder, &record)?;
    }
    if let Some(path) = &args.json {
        record.write_scores(path)?;
    }
    Ok(ExitCode::SUCCESS)
}

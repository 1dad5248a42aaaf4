//! `keydance demo`: reads nothing, writes a folder of results: a run on generated clips from their
//! making to tables and figures.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context as _, bail};
use clap::Args;

use super::notice::notice;
use super::progress::Progress;
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{PrintedTables, ProtocolScores, TableRow, Tables};
use crate::models::{Generator, registry};
use crate::report::demo::{self, Demo, DemoOptions, Losses, OpenDemo, OtherScores};
use crate::report::{schedule_note, thousands};
use crate::run::RunFolder;
use crate::training::Trainer;

/// Exit code of a demo whose model misses the goal.
const MISSED: u8 = 4;

/// Generate dance clips, train a small model on them, score it beside what needs no training
///
/// No data needed, the same numbers each time. Of Pan et al. (pan2021), two to three minutes on two
/// cores: the model is to be ahead in LRP at 100 and 150 frames, of interpolation and of the linear
/// estimate that it was before its training. Of Pu and Shan (pu2022), with music, five minutes: its
/// consistency error is to be below half of a held pose's, and its beats to hit those of the music
/// more often than by chance (97.5 % of 200 shifts of the beats). Exit code 4 if the goal is missed.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Paper whose model is shown: pan2021, pu2022 [default: pan2021]
    #[arg(long, value_name = "NAME")]
    paper: Option<String>,
    /// Folder for the results; those of an earlier demo there are replaced [default: results/demo;
    /// with --paper results/demo_NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Fewer and shorter clips and a fraction of the training: about 20 seconds, the same files and
    /// the same demand on the model
    #[arg(long)]
    reduced: bool,
    /// Share of the demo's schedule that is trained, above 0 and at most 1, instead of its own
    #[arg(long, value_name = "F")]
    fraction: Option<f64>,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// There is no such demo, the folder holds something else, or a file cannot be written.
pub fn run(args: DemoArgs) -> anyhow::Result<ExitCode> {
    let begun = Instant::now();
    let demo = opener(args.paper.as_deref())?(&DemoOptions {
        reduced: args.reduced,
        fraction: args.fraction,
    })?;
    let (demo, config) = (&*demo, demo.experiment());
    let folder = args.out.unwrap_or_else(|| match &args.paper {
        None => "results/demo".into(),
        Some(paper) => format!("results/demo_{paper}").into(),
    });
    let mut out = std::io::stdout();
    demo::check_folder(&folder)?;
    let run = RunFolder::replace(&folder, config)?;
    demo::begin_results(run.path(), demo)?;

    let dataset = demo.dataset()?;
    writeln!(out, "{}", demo::summary(demo, &dataset))?;
    let (untrained, losses) = train(demo, &dataset, args.threads.count(), &run)?;
    demo::write_losses(run.path(), &losses)?;

    let model = run.trained_model(config)?;
    let pool = args.threads.pool()?;
    // The first one alone: a paper's numbers are of other data, so how it counted adds nothing.
    let protocols = &config.protocols()[..1];
    let protocol = &*protocols[0];
    let evaluate = |model: &dyn Generator| {
        let part = DataPart::Test;
        pool.install(|| evaluate_watched(protocol, model, &dataset, part, true, None))
            .map(|evaluated| ProtocolScores::new([(protocol.name(), evaluated.scores)]))
    };
    let row = |title: &str, seed, scores: &ProtocolScores, note: String| TableRow {
        name: format!("{title}, generated clips"),
        seed,
        scores: Some(scores.clone()),
        schedule_note: note,
    };
    let (mut rows, mut others) = (Vec::new(), OtherScores::default());
    for other in demo.others(untrained) {
        let scores = evaluate(&*other.model)?;
        rows.push(row(other.title, None, &scores, other.note.into()));
        others.0.push((other.file, scores));
    }
    let scores = evaluate(&*model)?;
    let manifest = run.manifest()?.context("the training left no manifest")?;
    let note = schedule_note(config, &manifest);
    rows.push(row(demo.model_title(), Some(manifest.seed), &scores, note));
    let printed = &match demo.metrics() {
        [] => config.printed()?,
        metrics => PrintedTables::of_metrics(metrics),
    };
    let tables = Tables { protocols, printed };
    write!(out, "\n{}\n", tables.terminal(&rows))?;
    demo::write_scores(run.path(), demo, &dataset, &scores, &others, tables, &rows)?;

    writeln!(out, "{}", demo.show(&*model, &dataset, run.path())?)?;
    let seconds = begun.elapsed().as_secs_f64();
    writeln!(out, "{} in {seconds:.0} s", run.path().display())?;
    let verdict = demo.verdict(&scores, &others);
    writeln!(out, "{}", verdict.numbers)?;
    if verdict.reached {
        return Ok(ExitCode::SUCCESS);
    }
    notice(format_args!("error: {}", verdict.missed));
    Ok(ExitCode::from(MISSED))
}

/// What opens the demo of a paper; without a name, of the first that has one.
fn opener(paper: Option<&str>) -> anyhow::Result<OpenDemo> {
    let papers = registry::papers().into_iter();
    let demos = papers.filter_map(|paper| Some((paper.name, paper.demo?)));
    let demos: Vec<(&str, OpenDemo)> = demos.collect();
    let mut wanted = demos.iter();
    match wanted.find(|(name, _)| paper.is_none_or(|paper| paper == *name)) {
        Some((_, open)) => Ok(*open),
        None => {
            let known: Vec<&str> = demos.iter().map(|(name, _)| *name).collect();
            let (paper, known) = (paper.unwrap_or_default(), known.join(", "));
            bail!("--paper {paper}: no such paper has a demo; these have one: {known}")
        }
    }
}

/// Trains to the end of the schedule and shows the progress on stderr. The model with its initial
/// weights, and the losses.
fn train(
    demo: &dyn Demo,
    dataset: &Dataset,
    threads: usize,
    run: &RunFolder,
) -> anyhow::Result<(Box<dyn Generator>, Losses)> {
    let mut trainer = Trainer::new(demo.experiment().clone(), dataset, threads)?;
    writeln!(
        std::io::stdout(),
        "a {} with {} weights; {}, {} frame-steps on {}",
        demo.model_title(),
        thousands(trainer.parameters().weights() as u64),
        counted(trainer.task().steps(), "step"),
        thousands(trainer.task().frame_steps()),
        counted(threads, "thread")
    )?;
    let untrained = trainer.model();
    let mut progress = Progress::new(String::new(), trainer.task(), 0);
    let mut losses = Losses::default();
    let outcome = trainer.run(Some(run), &mut |report| {
        progress.step(report);
        losses.add(report);
        ControlFlow::Continue(())
    });
    drop(progress);
    outcome?;
    Ok((untrained, losses))
}

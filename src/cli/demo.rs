//! `keydance demo`: reads nothing, writes a folder of results: a run on generated clips from their
//! making to tables and figures.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::Context as _;
use clap::Args;

use super::notice::notice;
use super::progress::Progress;
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{ProtocolScores, Tables};
use crate::experiment::ExperimentConfig;
use crate::models::Generator;
use crate::models::baselines::interpolation::Interpolation;
use crate::models::transition::DanceClip;
use crate::report::demo::{self, Comparison, DemoSettings, Losses, Showcase};
use crate::report::thousands;
use crate::run::RunFolder;
use crate::training::Trainer;

/// Exit code of a demo whose model is behind interpolation or behind itself before its training.
const BEHIND: u8 = 4;

/// Generate dance clips, train a small model on them, score it beside what needs no training
///
/// No data needed, two to three minutes on two cores, the same numbers each time. Exit code 4 if
/// the model is not ahead in LRP at 100 and 150 frames, of interpolation and of the linear estimate
/// that it was before its training.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Folder for the results; those of an earlier demo there are replaced
    #[arg(long, value_name = "DIR", default_value = "results/demo")]
    out: PathBuf,
    /// Fewer and shorter clips and about a seventh of the training: about 20 seconds, the same
    /// files and the same demand on the model
    #[arg(long)]
    reduced: bool,
    /// Share of the demo's schedule that is trained, above 0 and at most 1, instead of the one in
    /// experiments/demo.toml
    #[arg(long, value_name = "F")]
    fraction: Option<f64>,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// The folder holds something else, or a file cannot be written.
pub fn run(args: DemoArgs) -> anyhow::Result<ExitCode> {
    let begun = Instant::now();
    let settings = DemoSettings::new(args.reduced, args.fraction)?;
    let config = &settings.experiment;
    let mut out = std::io::stdout();
    demo::check_folder(&args.out)?;
    let run = RunFolder::replace(&args.out, config)?;
    demo::begin_results(run.path(), &settings)?;

    let dataset = settings.dataset()?;
    writeln!(out, "{}", settings.summary(&dataset))?;
    let (untrained, losses) = train(config, &dataset, args.threads.count(), &run)?;
    demo::write_losses(run.path(), &losses)?;

    let model = run.trained_model(config)?;
    let interpolation = Interpolation {
        contact_threshold: config.data.contact_threshold,
    };
    let pool = args.threads.pool()?;
    // The paper's numbers are of other data, so its own way of counting adds nothing here.
    let protocols = &config.protocols()[..1];
    let protocol = &*protocols[0];
    let evaluate = |model: &dyn Generator| {
        let part = DataPart::Test;
        pool.install(|| evaluate_watched(protocol, model, &dataset, part, true, None))
            .map(|evaluated| ProtocolScores::new([(protocol.name(), evaluated.scores)]))
    };
    let comparison = Comparison {
        interpolation: evaluate(&interpolation)?,
        untrained: evaluate(&*untrained)?,
        model: evaluate(&*model)?,
    };
    let manifest = run.manifest()?.context("the training left no manifest")?;
    let rows = comparison.rows(config, &manifest);
    let printed = &config.printed()?;
    let tables = Tables { protocols, printed };
    write!(out, "\n{}\n", tables.terminal(&rows))?;
    demo::write_scores(run.path(), &settings, &dataset, &comparison, tables, &rows)?;

    let clips = DanceClip::measure_all(&dataset.test, &config.data.features())?;
    let showcase = Showcase::new(&clips)?;
    let motion = showcase.write(&interpolation, &*model, run.path())?;
    writeln!(
        out,
        "{}: {showcase}; its rotations meet the predicted positions to {:.1} cm in the mean, {:.1} cm at most",
        demo::TRANSITION,
        motion.mean_error,
        motion.max_error
    )?;
    let seconds = begun.elapsed().as_secs_f64();
    writeln!(out, "{} in {seconds:.0} s", run.path().display())?;
    writeln!(out, "{comparison}")?;
    if comparison.is_ahead() {
        return Ok(ExitCode::SUCCESS);
    }
    notice(
        "error: the trained model is not ahead of interpolation and of its own beginning at long \
         transitions",
    );
    Ok(ExitCode::from(BEHIND))
}

/// Trains to the end of the schedule and shows the progress on stderr. The model with its initial
/// weights, and the losses.
fn train(
    config: &ExperimentConfig,
    dataset: &Dataset,
    threads: usize,
    run: &RunFolder,
) -> anyhow::Result<(Box<dyn Generator>, Losses)> {
    let mut trainer = Trainer::new(config.clone(), dataset, threads)?;
    writeln!(
        std::io::stdout(),
        "a whole model with {} weights; {}, {} frame-steps on {}",
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

//! `keydance demo`: reads nothing, writes a folder of results: a run on generated clips from their
//! making to tables and figures.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::Args;

use super::notice::notice;
use super::progress::Progress;
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::counted::counted;
use crate::data::DataPart;
use crate::models::Generator;
use crate::report::demo::{Demo, DemoSettings, Losses};
use crate::report::thousands;
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
    let demo = Demo::begin(&args.out, DemoSettings::new(args.reduced, args.fraction)?)?;
    let mut out = std::io::stdout();
    writeln!(out, "{demo}")?;
    let untrained = train(&demo, args.threads.count())?;
    let (model, pool) = (demo.model()?, args.threads.pool()?);
    let (comparison, tables) = demo.compare(&*untrained, &*model, |protocol, model| {
        let (dataset, part) = (&demo.dataset, DataPart::Test);
        pool.install(|| evaluate_watched(protocol, model, dataset, part, true, None))
    })?;
    write!(out, "\n{tables}\n")?;
    writeln!(out, "{}", demo.show(&*model)?)?;
    let seconds = begun.elapsed().as_secs_f64();
    writeln!(out, "{} in {seconds:.0} s", args.out.display())?;
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
/// weights.
fn train(demo: &Demo, threads: usize) -> anyhow::Result<Box<dyn Generator>> {
    let mut trainer = Trainer::new(demo.config().clone(), &demo.dataset, threads)?;
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
    let outcome = trainer.run(Some(&demo.run), &mut |report| {
        progress.step(report);
        losses.add(report);
        ControlFlow::Continue(())
    });
    drop(progress);
    outcome?;
    demo.write_losses(&losses)?;
    Ok(untrained)
}

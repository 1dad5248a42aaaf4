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
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use super::watched::evaluate_watched;
use crate::counted::counted;
use crate::data::{DataPart, Dataset};
use crate::models::Generator;
use crate::report::demo::{self, Demo, DemoOptions, Losses};
use crate::report::thousands;
use crate::run::RunFolder;
use crate::training::{Outcome, Trainer};

/// Exit code of a demo whose model misses the goal.
const MISSED: u8 = 4;

/// Generate dance clips, train a small model on them, score it beside what needs no training
///
/// No data needed, the same numbers each time. Of Pan et al. (pan2021), two to three minutes on two
/// cores: the model is to be ahead in LRP at 100 and 150 frames, of interpolation and of the linear
/// estimate that it was before its training. Of Pu and Shan (pu2022), with music, six minutes: its
/// consistency error is to be below half of a held pose's, and its beats to hit those of the music
/// more often than by chance (97.5 % of 200 shifts of the beats). Of Valle-Pérez et al.
/// (valleperez2021), with music, three minutes: no dance is to freeze or diverge, the mean step to
/// be at most 1.5 times the data's, diversity above a third of it. Exit code 4 if the goal is
/// missed.
#[derive(Debug, Args)]
pub struct DemoArgs {
    /// Paper whose model is shown: pan2021, pu2022, valleperez2021 [default: pan2021]
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
    let demo = demo::opener(args.paper.as_deref())?(&DemoOptions {
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
    let stop = Stop::on_signal(format!("stopped; begin anew with\n  {}", command()))?;
    let run = RunFolder::replace(&folder, config)?;
    demo::begin_results(run.path(), demo)?;

    let dataset = demo.dataset()?;
    writeln!(out, "{}", demo::summary(demo, &dataset))?;
    let trained = train(demo, &dataset, args.threads.count(), &run, &stop)?;
    let Some((untrained, losses)) = trained else {
        return Ok(interrupted(&stop.farewell));
    };
    demo::write_losses(run.path(), &losses)?;

    let (model, pool) = (run.trained_model(config)?, args.threads.pool()?);
    let models = (untrained, &*model);
    let compared = demo::compare(demo, &dataset, &run, models, |protocol, model| {
        let (part, stop) = (DataPart::Test, Some(&stop));
        pool.install(|| evaluate_watched(protocol, model, &dataset, part, true, stop))
    });
    let (tables, verdict) = match compared {
        Err(_) if stop.is_asked() => return Ok(interrupted(&stop.farewell)),
        compared => compared?,
    };
    write!(out, "\n{tables}\n")?;
    writeln!(out, "{}", demo.show(&*model, &dataset, run.path())?)?;
    let seconds = begun.elapsed().as_secs_f64();
    writeln!(out, "{} in {seconds:.0} s", run.path().display())?;
    writeln!(out, "{}", verdict.numbers)?;
    if verdict.reached {
        return Ok(ExitCode::SUCCESS);
    }
    notice(format_args!("error: {}", verdict.missed));
    Ok(ExitCode::from(MISSED))
}

/// Trains to the end of the schedule and shows the progress on stderr. The model with its initial
/// weights, and the losses; none where it was stopped.
fn train(
    demo: &dyn Demo,
    dataset: &Dataset,
    threads: usize,
    run: &RunFolder,
    stop: &Stop,
) -> anyhow::Result<Option<(Box<dyn Generator>, Losses)>> {
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
        match stop.is_asked() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    drop(progress);
    Ok((outcome? == Outcome::Finished).then_some((untrained, losses)))
}

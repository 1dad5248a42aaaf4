//! `keydance train`: reads a config and a data folder, writes a run's folder.

use std::io::{self, Write as _};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use clap::Args;
use indicatif::HumanDuration;

use super::notice::{out, warn};
use super::progress::Progress;
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use crate::data::Dataset;
use crate::experiment::{Curves, ExperimentConfig};
use crate::models::weights::SavedWeights;
use crate::ranks::{self, Together};
use crate::run::RunFolder;
use crate::training::{Outcome, Resumed, Trainer};

#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Config of the experiment, TOML
    config: PathBuf,
    /// Folder of BVH files, or what prepare made of one
    #[arg(long, value_name = "DATA")]
    data: PathBuf,
    /// Folder for the run: config, manifest, log, checkpoints, weights
    #[arg(long, value_name = "RUN_DIR")]
    out: PathBuf,
    /// Config of overrides over the experiment's, such as experiments/budgets/pan2021.toml
    #[arg(long, value_name = "FILE")]
    budget: Option<PathBuf>,
    /// Override a key of the config, such as schedule.fraction=0.005; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on from the newest checkpoint in RUN_DIR; the end is the same to the bit as without the
    /// break
    #[arg(long)]
    resume: bool,
    /// Folder of a trained run whose weights it starts from, of the experiment that the config's
    /// key start names; the run keeps a copy
    #[arg(long, value_name = "RUN_DIR")]
    start: Option<PathBuf>,
    #[command(flatten)]
    threads: Threads,
}

/// What a training is made of, read from files.
struct Loaded {
    config: ExperimentConfig,
    dataset: Dataset,
    /// The weights that it starts from, and those of another run where they are given.
    start: Option<SavedWeights>,
    given: Option<PathBuf>,
}

impl Loaded {
    fn read(args: &TrainArgs) -> anyhow::Result<Self> {
        let config = ExperimentConfig::load_under(&args.config, args.budget.as_deref(), &args.set)?;
        let dataset = match config.model.reads_stored_clips() {
            true => Dataset::load_to_train(&args.data, &config.data)?,
            false => Dataset::load(&args.data, &config.data)?,
        };
        warn(&dataset.warnings);
        let given = args.start.as_ref();
        let given = given.map(|run| RunFolder::open(run).newest_weights());
        let given = given.transpose()?;
        let start = match &given {
            Some(path) => Some(SavedWeights::read(path)?),
            None => RunFolder::open(&args.out).start()?,
        };
        Ok(Self {
            config,
            dataset,
            start,
            given,
        })
    }
}

/// # Errors
/// The config, the data or the run's folder cannot be used; the training diverged; another rank
/// cannot go on.
pub fn run(args: TrainArgs) -> anyhow::Result<ExitCode> {
    let ranks = ranks::join("train")?;
    let mut together = Together::new(Arc::clone(&ranks));
    let loaded = together.agree(Loaded::read(&args))?;
    let threads = args.threads.count();
    let (config, dataset) = (loaded.config, &loaded.dataset);
    let trainer = Trainer::from_weights(config.clone(), dataset, threads, loaded.start.as_ref());
    let mut trainer = together.agree(trainer)?;
    let resume = if args.resume { "" } else { " --resume" };
    let stop = Stop::on_signal(String::new())?;
    let mut before_the_first_step = Some(stop.at_once(format!(
        "stopped before a step was done; go on with\n  {}{resume}",
        command()
    )));
    let taken = together
        .is_first()
        .then(|| take_up(&args, loaded.given.as_deref(), &mut trainer));
    let taken = together.agree(taken.transpose())?;
    let (run, resumed) = taken.unzip();
    trainer.join(ranks)?;
    let mut out = out();
    describe(&trainer)?;
    if let Some(expected) = trainer.expected() {
        let expected = HumanDuration(expected.max(Duration::from_secs(1)));
        writeln!(out, "takes about {expected}, as busy as the machine is now")?;
    }
    writeln!(out, "\n{}", config.to_toml()?)?;
    match resumed.flatten() {
        Some(Resumed { steps: 0, .. }) => writeln!(out, "no checkpoint yet: begins")?,
        Some(resumed) => goes_on(&resumed)?,
        None => {}
    }
    let mut progress = Progress::new(String::new(), trainer.task(), trainer.frame_steps_done());
    let outcome = trainer.run(run.as_ref(), &mut |report| {
        before_the_first_step = None;
        progress.step(report);
        match stop.is_asked() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    drop(progress);
    let finished = outcome? == Outcome::Finished;
    match run {
        Some(run) if finished => {
            Curves::write_into_run(&run, &config)?;
            writeln!(out, "{}", run.weights().display())?;
            writeln!(out, "weights {}", trainer.weights_digest())?;
            Ok(ExitCode::SUCCESS)
        }
        _ if finished => Ok(ExitCode::SUCCESS),
        _ => {
            let (done, all) = (trainer.steps_done(), trainer.task().steps());
            Ok(interrupted(format_args!(
                "stopped and saved after step {done} of {all}; go on with\n  {}{resume}",
                command()
            )))
        }
    }
}

/// The run's folder, and where the training goes on if it does.
fn take_up(
    args: &TrainArgs,
    start: Option<&Path>,
    trainer: &mut Trainer<'_>,
) -> anyhow::Result<(RunFolder, Option<Resumed>)> {
    let (run, resumed) = match args.resume {
        true => {
            let run = RunFolder::resume(&args.out, trainer.config())?;
            let resumed = trainer.resume(&run)?;
            (run, Some(resumed))
        }
        false => (RunFolder::create(&args.out, trainer.config())?, None),
    };
    if let Some(weights) = start {
        run.keep_start(weights)?;
    }
    Ok((run, resumed))
}

/// Says how large the training is, and what of it cannot be trained.
///
/// # Errors
/// The output cannot be written.
pub fn describe(trainer: &Trainer<'_>) -> io::Result<()> {
    writeln!(out(), "{}", trainer.summary())?;
    warn(trainer.warnings());
    Ok(())
}

/// Says after which step a training goes on, where it does not begin, and what is to be known of
/// that.
///
/// # Errors
/// The output cannot be written.
pub fn goes_on(resumed: &Resumed) -> io::Result<()> {
    warn(resumed.warnings());
    match resumed.steps {
        0 => Ok(()),
        steps => writeln!(out(), "goes on after step {steps}"),
    }
}

//! `keydance train`: reads a config and a data folder, writes a run's folder.

use std::io::{self, Write as _};
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use clap::Args;
use indicatif::HumanDuration;

use super::notice::warn;
use super::progress::Progress;
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use crate::data::Dataset;
use crate::experiment::{Curves, ExperimentConfig};
use crate::models::weights::SavedWeights;
use crate::run::RunFolder;
use crate::training::{Outcome, Resumed, Trainer};

#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Config of the experiment, TOML
    config: PathBuf,
    /// Folder of BVH files
    #[arg(long, value_name = "DIR")]
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

/// # Errors
/// The config, the data or the run's folder cannot be used; the training diverged.
pub fn run(args: TrainArgs) -> anyhow::Result<ExitCode> {
    let config = ExperimentConfig::load_under(&args.config, args.budget.as_deref(), &args.set)?;
    let mut out = io::stdout();
    let dataset = Dataset::load(&args.data, &config.data)?;
    warn(&dataset.warnings);
    let given = args.start.as_ref();
    let given = given.map(|run| RunFolder::open(run).newest_weights());
    let given = given.transpose()?;
    let start = match &given {
        Some(path) => Some(SavedWeights::read(path)?),
        None => RunFolder::open(&args.out).start()?,
    };
    let threads = args.threads.count();
    let mut trainer = Trainer::from_weights(config.clone(), &dataset, threads, start.as_ref())?;
    let (run, resumed) = if args.resume {
        let run = RunFolder::resume(&args.out, &config)?;
        let resumed = trainer.resume(&run)?;
        (run, Some(resumed))
    } else {
        (RunFolder::create(&args.out, &config)?, None)
    };
    if let Some(weights) = &given {
        run.keep_start(weights)?;
    }
    describe(&trainer)?;
    if let Some(expected) = trainer.expected() {
        let expected = HumanDuration(expected.max(Duration::from_secs(1)));
        writeln!(out, "takes about {expected}, as busy as the machine is now")?;
    }
    writeln!(out, "\n{}", config.to_toml()?)?;
    match resumed {
        Some(Resumed { steps: 0, .. }) => writeln!(out, "no checkpoint yet: begins")?,
        Some(resumed) => goes_on(&resumed)?,
        None => {}
    }
    let mut progress = Progress::new(String::new(), trainer.task(), trainer.frame_steps_done());
    let stop = Stop::on_signal(String::new())?;
    let outcome = trainer.run(Some(&run), &mut |report| {
        progress.step(report);
        match stop.is_asked() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    drop(progress);
    match outcome? {
        Outcome::Finished => {
            Curves::write_into_run(&run, &config)?;
            writeln!(out, "{}", run.weights().display())?;
            writeln!(out, "weights {}", trainer.weights_digest())?;
            Ok(ExitCode::SUCCESS)
        }
        Outcome::Stopped => {
            let (done, all) = (trainer.steps_done(), trainer.task().steps());
            let resume = if args.resume { "" } else { " --resume" };
            Ok(interrupted(format_args!(
                "stopped and saved after step {done} of {all}; go on with\n  {}{resume}",
                command()
            )))
        }
    }
}

/// Says how large the training is, and what of it cannot be trained.
///
/// # Errors
/// The output cannot be written.
pub fn describe(trainer: &Trainer<'_>) -> io::Result<()> {
    writeln!(io::stdout(), "{}", trainer.summary())?;
    warn(trainer.task().warnings());
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
        steps => writeln!(io::stdout(), "goes on after step {steps}"),
    }
}

//! `keydance reproduce`: reads a folder of configs and a data folder, trains and evaluates each,
//! writes tables, figures and a manifest.

use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::anyhow;
use clap::Args;

use super::list::name;
use super::notice::{notice, warn};
use super::progress::Progress;
use super::stop::{Stop, command, interrupted};
use super::threads::Threads;
use super::train;
use super::watched::evaluate_watched;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{Evaluation, EvaluationError, Protocol};
use crate::experiment::{
    Ending, Observer, ReproduceError, Reproduction, Row, Seeds, StepObserver, rows,
};
use crate::models::Generator;
use crate::training::{Resumed, Trainer, TrainingError};

/// Train and evaluate every config of a folder, and write tables, figures and a manifest
///
/// Train every config of a folder that is not trained yet, evaluate it on the test clips and write
/// the paper's tables with its value, ours and the difference, figures and a manifest.
///
/// A row whose results are in OUT is done. A row whose run is in RUNS goes on from its newest
/// checkpoint, also after a kill; the end is the same to the bit as without the break. Tables are
/// written again after every row; rows that are missing show "—". Ctrl-C stops training and
/// evaluation; the same command goes on.
///
/// On several machines that share OUT and RUNS, each --task K of those that --list names may run at
/// the same time; afterwards --no-training writes the tables.
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Folder of configs, such as experiments/pan2021
    #[arg(value_name = "CONFIGS")]
    configs: PathBuf,
    /// Folder of BVH files, or what prepare made of one
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Folder for the results, small files: tables, figures, manifest, and a folder for each row
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder for the runs, large: checkpoints, logs and weights [default: runs/ and the name of
    /// OUT]
    #[arg(long, value_name = "DIR")]
    runs: Option<PathBuf>,
    /// Config of overrides for all rows alike, such as experiments/budgets/pan2021.toml
    #[arg(long, value_name = "FILE")]
    budget: Option<PathBuf>,
    /// Override a key of all configs, such as schedule.fraction=0.005; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Train and evaluate these models only; the tables keep what there is of the others
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = name)]
    only: Vec<String>,
    /// Train a model from several seeds, such as whole_model=1,2,3, and show the spread; may be
    /// repeated
    #[arg(long, value_name = "NAME=SEEDS")]
    seeds: Vec<Seeds>,
    /// Train nothing: evaluate the runs that are finished and write the tables
    #[arg(long)]
    no_training: bool,
    /// Print the tasks that the rows fall into, and end: number, core hours that are left to train
    /// as busy as the machine is, rows; rows that share a training are one task
    #[arg(long, conflicts_with_all = ["task", "no_training"])]
    list: bool,
    /// Train and evaluate the rows of this task of --list alone, and write no tables
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    task: Option<u32>,
    /// Rows to train at the same time, the threads shared among them; no number in the result
    /// depends on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: u16,
    /// Write into a folder that holds other files or tables of other rows, and replace the tables
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// Configs or data cannot be used; results or a run are of another config or other data; a training
/// diverged (the other rows are trained all the same); a file cannot be written.
pub fn run(args: ReproduceArgs) -> anyhow::Result<ExitCode> {
    let (rows, printed) = rows::read(
        &args.configs,
        args.budget.as_deref(),
        &args.set,
        &args.only,
        &args.seeds,
    )
    .map_err(|error| match error {
        ReproduceError::NoConfig { .. } => anyhow!("{error}; experiments/pan2021 does"),
        other => other.into(),
    })?;
    let chosen = rows::chosen(&rows, &args.only, &args.configs)?;
    let runs = match &args.runs {
        Some(runs) => runs.clone(),
        None => rows::runs_folder(&args.out)?,
    };
    let dataset = rows::dataset(&rows, &args.data)?;
    warn(&dataset.warnings);
    let terminal = Terminal {
        alone: args.jobs == 1,
        stop: Stop::on_signal(format!("stopped and saved; go on with\n  {}", command()))?,
    };
    let mut reproduction = Reproduction {
        rows: &rows,
        chosen: &chosen,
        dataset: &dataset,
        printed: &printed,
        out: &args.out,
        runs: &runs,
        threads: args.threads.shared(args.jobs).count(),
        jobs: args.jobs.into(),
        no_training: args.no_training,
        tables: args.task.is_none(),
        observer: &terminal,
    };
    reproduction.check_out(args.force)?;
    if args.list {
        reproduction.threads = 1;
        return list(&reproduction);
    }
    let tasks = reproduction.tasks()?;
    if let Some(task) = args.task {
        let rows = tasks.get(task as usize - 1);
        let none = || {
            anyhow!(
                "--task {task}: there are {}; --list names them",
                tasks.len()
            )
        };
        reproduction.chosen = rows.ok_or_else(none)?;
    }
    let ending = reproduction.run().map_err(|error| match error {
        // By itself: whether the output is closed is seen from its kind.
        ReproduceError::Output(error) => error.into(),
        other => anyhow::Error::new(other),
    })?;
    match ending {
        Ending::Finished => {
            writeln!(io::stdout(), "{}", args.out.display())?;
            Ok(ExitCode::SUCCESS)
        }
        Ending::Stopped => Ok(interrupted(&terminal.stop.farewell)),
        Ending::Diverged(error) => Err(anyhow::Error::new(error).context("a training diverged")),
    }
}

/// Prints the tasks, one a line.
fn list(reproduction: &Reproduction<'_>) -> anyhow::Result<ExitCode> {
    for (index, rows) in reproduction.tasks()?.into_iter().enumerate() {
        let hours = reproduction.expected(&rows)?.as_secs_f64() / 3600.0;
        let names: Vec<&str> = rows.iter().map(|row| row.folder.as_str()).collect();
        writeln!(
            io::stdout(),
            "{}\t{hours:.2}\t{}",
            index + 1,
            names.join(",")
        )?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Says on the terminal how it goes, and stops on Ctrl-C.
struct Terminal {
    /// Whether there is one job only, which may draw bars.
    alone: bool,
    stop: Stop,
}

impl Observer for Terminal {
    fn row(&self, row: &Row, number: usize, of: usize) -> io::Result<()> {
        writeln!(io::stdout(), "== {} ({number} of {of})", row.folder)
    }

    fn note(&self, note: &str) -> io::Result<()> {
        writeln!(io::stdout(), "{note}")
    }

    fn warning(&self, warning: &str) {
        notice(format_args!("warning: {warning}"));
    }

    fn diverged(&self, row: &Row, error: &TrainingError) {
        notice(format_args!("error: {}: {error}", row.folder));
    }

    fn training(&self, trainer: &Trainer<'_>) -> io::Result<()> {
        train::describe(trainer)
    }

    fn steps(
        &self,
        row: &Row,
        trainer: &Trainer<'_>,
        resumed: &Resumed,
    ) -> io::Result<StepObserver> {
        train::goes_on(resumed)?;
        let (task, before) = (trainer.task(), trainer.frame_steps_done());
        let name = match self.alone {
            true => String::new(),
            false => format!("{}: ", row.folder),
        };
        let mut progress = Progress::new(name, task, before);
        let training = self.stop.training();
        Ok(Box::new(move |report| {
            let _until_it_is_saved = &training;
            progress.step(report);
        }))
    }

    fn evaluate(
        &self,
        protocol: &dyn Protocol,
        model: &dyn Generator,
        dataset: &Dataset,
    ) -> Result<Evaluation, EvaluationError> {
        let (part, stop) = (DataPart::Test, Some(&self.stop));
        evaluate_watched(protocol, model, dataset, part, self.alone, stop)
    }

    fn stop_asked(&self) -> bool {
        self.stop.is_asked()
    }
}

//! `keydance reproduce`: reads a folder of configs and a data folder, trains and evaluates each, writes tables, figures and a manifest.

mod report;
mod results;
mod rows;

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use anyhow::{Context as _, bail};
use clap::Args;

use self::report::Reported;
use self::results::RowResults;
use self::rows::{Row, Seeds};
use super::notice::notice;
use super::progress::Progress;
use super::stop::{Stop, interrupted, quote};
use super::threads::Threads;
use super::train;
use super::watched::evaluate_watched;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{Evaluation, Protocol};
use crate::models::transition::TransitionModel;
use crate::run::{RunFolder, RunState};
use crate::training::{Outcome, Trainer, TrainingError};

/// Trains every config of a folder that is not trained yet, evaluates it on the test clips and writes tables 2 to 4 with the paper's
/// value, ours and the difference, figures and a manifest.
///
/// A row whose results are in OUT is done. A row whose run is in RUNS goes on from its newest checkpoint, also after a kill; the end
/// is the same to the bit as without the break. Tables are written again after every row; rows that are missing show "—".
#[derive(Debug, Args)]
pub struct ReproduceArgs {
    /// Folder of configs, such as experiments/pan2021
    #[arg(value_name = "CONFIGS")]
    configs: PathBuf,
    /// Folder of BVH files
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Folder for the results, small files: tables, figures, manifest, and a folder for each row
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder for the runs, large: checkpoints, logs and weights [default: runs/ and the name of OUT]
    #[arg(long, value_name = "DIR")]
    runs: Option<PathBuf>,
    /// Config of overrides for all rows alike, such as experiments/budgets/pan2021.toml
    #[arg(long, value_name = "FILE")]
    budget: Option<PathBuf>,
    /// Override a key of all configs, such as schedule.fraction=0.005; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Train and evaluate these models only; the tables keep what there is of the others
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    only: Vec<String>,
    /// Train a model from several seeds, such as whole_model=1,2,3, and show the spread; may be repeated
    #[arg(long, value_name = "NAME=SEEDS")]
    seeds: Vec<Seeds>,
    /// Train nothing: evaluate the runs that are finished and write the tables
    #[arg(long)]
    no_training: bool,
    /// Rows to train at the same time, the threads shared among them; no number in the result depends on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    jobs: u16,
    #[command(flatten)]
    threads: Threads,
}

/// How a row ended.
enum RowOutcome {
    Done,
    /// Asked to stop, or not to train.
    Left,
    Diverged(TrainingError),
}

/// # Errors
/// Configs or data cannot be used; results or a run are of another config or other data; a training diverged (the other rows are
/// trained all the same); a file cannot be written.
pub fn run(args: ReproduceArgs) -> anyhow::Result<ExitCode> {
    let rows = rows::read(
        &args.configs,
        args.budget.as_deref(),
        &args.set,
        &args.seeds,
    )?;
    let chosen = rows::chosen(&rows, &args.only, &args.configs)?;
    let runs = match (&args.runs, args.out.file_name()) {
        (Some(runs), _) => runs.clone(),
        (None, Some(name)) => Path::new("runs").join(name),
        (None, None) => bail!(
            "--out {} has no name for a folder of runs; give --runs",
            args.out.display()
        ),
    };
    let dataset = dataset(&rows, &args.data)?;
    DataPart::Test.of(&dataset)?;
    let workshop = Workshop {
        dataset: &dataset,
        out: &args.out,
        runs: &runs,
        threads: args.threads.shared(args.jobs),
        alone: args.jobs == 1,
        no_training: args.no_training,
        stop: Stop::on_signal()?,
    };
    for row in &rows {
        workshop.check(row)?;
    }
    let line = Line {
        workshop: &workshop,
        rows: &rows,
        chosen: &chosen,
        next: AtomicUsize::new(0),
        diverged: Mutex::new(None),
    };
    std::thread::scope(|scope| {
        let jobs = (0..args.jobs).map(|_| scope.spawn(|| line.work()));
        // All begin before one is waited for.
        let jobs: Vec<_> = jobs.collect();
        jobs.into_iter().try_for_each(|job| match job.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        })
    })?;
    let diverged = line
        .diverged
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    workshop.report(&rows)?;
    if workshop.stop.is_asked() {
        notice(format_args!(
            "stopped and saved; go on with\n  {}",
            same_command()
        ));
        return Ok(interrupted());
    }
    if let Some(error) = diverged {
        return Err(anyhow::Error::new(error).context("a training diverged"));
    }
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(ExitCode::SUCCESS)
}

/// Rows in a line, taken one after the other by the jobs.
struct Line<'a> {
    workshop: &'a Workshop<'a>,
    rows: &'a [Row],
    chosen: &'a [&'a Row],
    /// The next of `chosen`; all are taken once a job has failed.
    next: AtomicUsize,
    /// The last training that diverged; held while the tables are written.
    diverged: Mutex<Option<TrainingError>>,
}

impl Line<'_> {
    /// Finishes row after row until none is left or the user asks to stop.
    fn work(&self) -> anyhow::Result<()> {
        while !self.workshop.stop.is_asked() {
            let index = self.next.fetch_add(1, Ordering::Relaxed);
            let Some(row) = self.chosen.get(index) else {
                break;
            };
            let of = self.chosen.len();
            writeln!(
                std::io::stdout(),
                "== {} ({} of {of})",
                row.folder,
                index + 1
            )?;
            let outcome = self.workshop.finish(row).and_then(|outcome| {
                let mut diverged = self.diverged.lock().unwrap_or_else(PoisonError::into_inner);
                match outcome {
                    RowOutcome::Done => self.workshop.report(self.rows)?,
                    RowOutcome::Diverged(error) => {
                        notice(format_args!("error: {}: {error}", row.folder));
                        *diverged = Some(error);
                    }
                    RowOutcome::Left => {}
                }
                Ok(())
            });
            if outcome.is_err() {
                self.next.store(self.chosen.len(), Ordering::Relaxed);
                return outcome;
            }
        }
        Ok(())
    }
}

/// The data set of all rows.
fn dataset(rows: &[Row], folder: &Path) -> anyhow::Result<Dataset> {
    let (first, others) = rows.split_first().context("there are no rows")?;
    for row in others {
        if row.config.data != first.config.data {
            let differences = row
                .config
                .differences(&crate::experiment::ExperimentConfig {
                    data: first.config.data.clone(),
                    ..row.config.clone()
                })?;
            bail!(
                "rows of one table are on the same data, but {} and {} differ in {}",
                row.folder,
                first.folder,
                differences.join("; ")
            );
        }
    }
    Ok(Dataset::load(folder, &first.config.data)?)
}

/// Where rows are trained and evaluated.
struct Workshop<'a> {
    dataset: &'a Dataset,
    out: &'a Path,
    runs: &'a Path,
    /// Of one row.
    threads: Threads,
    /// Whether there is one job only, which may draw bars on a terminal.
    alone: bool,
    no_training: bool,
    stop: Stop,
}

impl Workshop<'_> {
    fn run_of(&self, row: &Row) -> RunFolder {
        RunFolder::open(&self.runs.join(&row.folder))
    }

    /// Refuses results and runs of another config or other data, before anything is trained.
    fn check(&self, row: &Row) -> anyhow::Result<()> {
        RowResults::of(row, self.out).read(row, self.dataset)?;
        let run = self.run_of(row);
        if !run.config_path().exists() {
            // The model, the schedule and the validation are refused here, not when hours of other rows are over.
            if row.is_trained() && !self.no_training {
                Trainer::new(row.config.clone(), self.dataset, 1)
                    .with_context(|| row.folder.clone())?;
            }
            return Ok(());
        }
        let manifest = run.manifest()?;
        let config = run.config()?;
        let differences = match &manifest {
            // Nothing of it is trained any more.
            Some(manifest) if manifest.state == RunState::Finished => {
                config.training_differences(&row.config)?
            }
            _ => config.differences(&row.config)?,
        };
        if !differences.is_empty() {
            return Err(TrainingError::OtherConfig {
                path: run.config_path(),
                differences,
            }
            .into());
        }
        match manifest {
            Some(manifest) if manifest.data_digest != self.dataset.digest => {
                Err(TrainingError::OtherData {
                    path: run.path().into(),
                    saved: manifest.data_digest,
                    found: self.dataset.digest.clone(),
                }
                .into())
            }
            _ => Ok(()),
        }
    }

    /// Trains and evaluates what is left of a row.
    fn finish(&self, row: &Row) -> anyhow::Result<RowOutcome> {
        let results = RowResults::of(row, self.out);
        let mut out = std::io::stdout();
        if results.read(row, self.dataset)?.is_some() {
            writeln!(out, "done, see {}", self.out.join(&row.folder).display())?;
            return Ok(RowOutcome::Done);
        }
        let untrained = row
            .config
            .model
            .untrained(row.config.data.contact_threshold);
        if let Some(model) = untrained {
            let evaluation = self.evaluate(model.as_ref())?;
            results.write(row, None, evaluation, self.dataset)?;
            return Ok(RowOutcome::Done);
        }
        let run = self.run_of(row);
        let finished = run
            .manifest()?
            .is_some_and(|manifest| manifest.state == RunState::Finished);
        if !finished {
            if self.no_training {
                writeln!(out, "not trained yet")?;
                return Ok(RowOutcome::Left);
            }
            match self.train(row) {
                Ok(Outcome::Finished) => {}
                Ok(Outcome::Stopped) => return Ok(RowOutcome::Left),
                Err(error) => match error.downcast() {
                    Ok(error @ TrainingError::NonFinite { .. }) => {
                        return Ok(RowOutcome::Diverged(error));
                    }
                    Ok(error) => return Err(error.into()),
                    Err(error) => return Err(error),
                },
            }
        }
        let evaluation = self.evaluate(&run.trained_model(&row.config)?)?;
        results.write(row, Some(&run), evaluation, self.dataset)?;
        Ok(RowOutcome::Done)
    }

    fn train(&self, row: &Row) -> anyhow::Result<Outcome> {
        let threads = self.threads.count();
        let mut trainer = Trainer::new(row.config.clone(), self.dataset, threads)?;
        train::describe(&trainer, threads)?;
        let path = self.runs.join(&row.folder);
        let run = train::resume(&mut trainer, &path, &row.config)?;
        let (schedule, before) = (trainer.schedule(), trainer.frame_steps_done());
        let progress = match self.alone {
            true => Progress::new(schedule, before),
            false => Progress::lines(format!("{}: ", row.folder), schedule, before),
        };
        Ok(train::train(&mut trainer, &run, &self.stop, progress)?)
    }

    fn evaluate(&self, model: &dyn TransitionModel) -> anyhow::Result<Evaluation> {
        let protocol = Protocol::default();
        let clips = &self.dataset.test;
        let outcome = self.threads.pool()?.install(|| match self.alone {
            true => evaluate_watched(&protocol, model, clips),
            false => protocol.evaluate(model, clips),
        })?;
        for skipped in &outcome.skipped {
            notice(format_args!("warning: {skipped}"));
        }
        Ok(outcome.evaluation)
    }

    /// Writes tables, figures and manifest from what there is.
    fn report(&self, rows: &[Row]) -> anyhow::Result<()> {
        let reported: Vec<Reported<'_>> = rows
            .iter()
            .map(|row| {
                let results = RowResults::of(row, self.out);
                Ok(Reported {
                    row,
                    record: results.read(row, self.dataset)?,
                    results,
                    run: self.run_of(row),
                })
            })
            .collect::<anyhow::Result<_>>()?;
        report::write(self.out, &reported, &self.dataset.digest)
    }
}

/// The command as it was given.
fn same_command() -> String {
    let words = std::env::args().skip(1).map(|word| quote(&word));
    format!("keydance {}", words.collect::<Vec<_>>().join(" "))
}

//! The rows of a table, each trained and evaluated, with tables, a figure and a manifest of them
//! all.

use std::io;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use super::ReproduceError;
use super::results::RowResults;
use super::rows::Row;
use crate::data::{DataPart, Dataset};
use crate::evaluation::{Evaluation, EvaluationError, PrintedTables, Protocol, ProtocolScores};
use crate::models::Generator;
use crate::run::{Manifest, RunFolder, RunState};
use crate::step::pool;
use crate::training::{Outcome, Resumed, StepReport, Trainer, TrainingError};

/// Is told how a reproduction goes, by several threads where several rows are trained at the same
/// time, and may stop it.
///
/// An error of a method ends the reproduction: what it says cannot be written any more.
pub trait Observer: Sync {
    /// Row `number` of `of`, counted from 1, begins.
    fn row(&self, _row: &Row, _number: usize, _of: usize) -> io::Result<()> {
        Ok(())
    }

    /// What became of the row at hand without any work.
    fn note(&self, _note: &str) -> io::Result<()> {
        Ok(())
    }

    /// Something that the user should know of.
    fn warning(&self, _warning: &str) {}

    /// The training of a row diverged; the other rows go on.
    fn diverged(&self, _row: &Row, _error: &TrainingError) {}

    /// A training is about to begin or to go on.
    fn training(&self, _trainer: &Trainer<'_>) -> io::Result<()> {
        Ok(())
    }

    /// A training goes on after what `resumed` says; the result is told each of its steps.
    fn steps(
        &self,
        _row: &Row,
        _trainer: &Trainer<'_>,
        _resumed: &Resumed,
    ) -> io::Result<StepObserver> {
        Ok(Box::new(|_| {}))
    }

    /// Evaluates a model on the test clips as `protocol` says: whoever shows how far that is wraps
    /// the model.
    fn evaluate(
        &self,
        protocol: &dyn Protocol,
        model: &dyn Generator,
        dataset: &Dataset,
    ) -> Result<Evaluation, EvaluationError> {
        protocol.evaluate(model, dataset, DataPart::Test)
    }

    /// Whether to stop after the step, or in the evaluation, at hand.
    fn stop_asked(&self) -> bool {
        false
    }
}

/// Is told each step of a training.
pub type StepObserver = Box<dyn FnMut(&StepReport)>;

/// What is trained and evaluated, on what, and where it goes.
pub struct Reproduction<'a> {
    /// All rows of the tables.
    pub rows: &'a [Row],
    /// Those to train and evaluate; the tables keep what there is of the others.
    pub chosen: &'a [&'a Row],
    pub dataset: &'a Dataset,
    /// What the paper prints.
    pub printed: &'a PrintedTables,
    /// Folder for the results.
    pub out: &'a Path,
    /// Folder for the runs.
    pub runs: &'a Path,
    /// Threads of one row.
    pub threads: usize,
    /// Rows that are trained at the same time.
    pub jobs: usize,
    /// Only runs that are finished are evaluated.
    pub no_training: bool,
    /// Whether tables are written: not by one of several tasks, whose tables would have the rows
    /// that others are at.
    pub tables: bool,
    pub observer: &'a dyn Observer,
}

/// How a reproduction ended.
#[derive(Debug)]
pub enum Ending {
    /// All that was asked for is done.
    Finished,
    /// The observer asked to stop; what was trained is saved.
    Stopped,
    /// Trainings diverged, this one last; all other rows are done.
    Diverged(TrainingError),
}

impl<'a> Reproduction<'a> {
    /// Trains and evaluates what is left of the chosen rows, and writes the tables again after
    /// each.
    ///
    /// # Errors
    /// Results or a run are of another config or other data; a file cannot be read or written; the
    /// observer has an error.
    pub fn run(&self) -> Result<Ending, ReproduceError> {
        DataPart::Test.of(self.dataset)?;
        for row in self.rows {
            self.check(row)?;
        }
        let (next, diverged) = (AtomicUsize::new(0), Mutex::new(None));
        let trainings: Vec<Mutex<()>> = self.rows.iter().map(|_| Mutex::new(())).collect();
        std::thread::scope(|scope| {
            let job = || self.work(&next, &diverged, &trainings);
            let jobs = (0..self.jobs).map(|_| scope.spawn(job));
            // All begin before one is waited for.
            let jobs: Vec<_> = jobs.collect();
            jobs.into_iter().try_for_each(|job| match job.join() {
                Ok(result) => result,
                Err(panic) => std::panic::resume_unwind(panic),
            })
        })?;
        self.report()?;
        let diverged = diverged
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        Ok(match diverged {
            _ if self.observer.stop_asked() => Ending::Stopped,
            Some(error) => Ending::Diverged(error),
            None => Ending::Finished,
        })
    }

    /// Finishes row after row until none is left or the user asks to stop. `next` is the next of
    /// `chosen`: all are taken once a job has failed. `diverged` is the last training that did so;
    /// it is held while the tables are written. Each of `trainings` is held while its row trains.
    fn work(
        &self,
        next: &AtomicUsize,
        diverged: &Mutex<Option<TrainingError>>,
        trainings: &[Mutex<()>],
    ) -> Result<(), ReproduceError> {
        while !self.observer.stop_asked() {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(row) = self.chosen.get(index) else {
                break;
            };
            self.observer.row(row, index + 1, self.chosen.len())?;
            let finished = self.finish(row, trainings);
            let mut diverged = diverged.lock().unwrap_or_else(PoisonError::into_inner);
            let outcome = match finished {
                Err(ReproduceError::Training(error)) if error.is_divergence() => {
                    self.observer.diverged(row, &error);
                    *diverged = Some(error);
                    Ok(())
                }
                // What is scored of the row is scored again when the command goes on.
                Err(ReproduceError::Evaluation(error)) if error.is_stopped() => Ok(()),
                finished => finished.and_then(|()| self.report()),
            };
            if outcome.is_err() {
                next.store(self.chosen.len(), Ordering::Relaxed);
                return outcome;
            }
        }
        Ok(())
    }

    /// The first of the rows, by number, that is trained as this one is: rows that differ only in
    /// what acts after the network share a training.
    pub(super) fn trained_as(&self, row: &Row) -> Result<usize, ReproduceError> {
        for (number, other) in self.rows.iter().enumerate() {
            let mut differences = other.config.training_differences(&row.config)?;
            differences.retain(|difference| !difference.starts_with("name:"));
            if differences.is_empty() {
                return Ok(number);
            }
        }
        Ok(0)
    }

    /// The run that a row's weights come from.
    ///
    /// # Errors
    /// A config with a number that TOML does not have.
    pub(super) fn run_of(&self, row: &Row) -> Result<RunFolder, ReproduceError> {
        let trained = self.rows.get(self.trained_as(row)?).unwrap_or(row);
        Ok(RunFolder::open(&self.runs.join(&trained.folder)))
    }

    /// Refuses results and runs of another config or other data, before anything is trained.
    fn check(&self, row: &Row) -> Result<(), ReproduceError> {
        RowResults::of(row, self.out).read(row, self.dataset)?;
        let trained = self.rows.get(self.trained_as(row)?);
        if trained.is_some_and(|trained| trained != row) {
            // Its run is checked as that row's.
            return Ok(());
        }
        let run = self.run_of(row)?;
        if !run.config_path().exists() {
            // The model, the schedule and the validation are refused here, not when hours of other
            // rows are over.
            if row.is_trained() && !self.no_training && row.config.start.is_none() {
                let trainer = Trainer::new(row.config.clone(), self.dataset, 1);
                trainer.map_err(|error| ReproduceError::Row {
                    row: row.folder.clone(),
                    source: error.into(),
                })?;
            }
            return Ok(());
        }
        let manifest = run.manifest()?;
        let config = run.config()?;
        run.check_config(&match is_finished(manifest.as_ref()) {
            // Nothing of it is trained any more.
            true => config.training_differences(&row.config)?,
            false => config.differences(&row.config)?,
        })?;
        if let Some(Manifest { data_digest, .. }) = manifest {
            RunFolder::check_data(run.path(), &data_digest, &self.dataset.digest)?;
        }
        Ok(())
    }

    /// Trains and evaluates what is left of a row.
    fn finish(&self, row: &Row, trainings: &[Mutex<()>]) -> Result<(), ReproduceError> {
        let results = RowResults::of(row, self.out);
        let (trained_as, run) = (self.trained_as(row)?, self.run_of(row)?);
        let training = trainings.get(trained_as);
        // Another row with the same training may be at it: this one waits for it.
        let _held = training.map(|it| it.lock().unwrap_or_else(PoisonError::into_inner));
        let finished = is_finished(run.manifest()?.as_ref());
        if let Some(record) = results.read(row, self.dataset)? {
            let protocols = row.config.protocols().into_iter();
            let names = protocols.map(|protocol| protocol.name());
            let missing: Vec<&str> = names.filter(|it| record.scores.by(it).is_none()).collect();
            let folder = self.out.join(&row.folder);
            let folder = folder.display();
            if missing.is_empty() {
                return Ok(self.observer.note(&format!("done, see {folder}"))?);
            }
            // Scores of a training that is gone stay; to train it again is for the user to ask.
            if row.is_trained() && !finished {
                let (missing, runs) = (missing.join(", "), self.runs.display());
                return Ok(self.observer.note(&format!(
                    "done, see {folder}, but not scored by {missing}: {runs} has no run of it; \
                     remove the folder to train it again"
                ))?);
            }
        }
        if let Some(mut model) = row.config.model.untrained(&row.config.data) {
            model.look_up_in(&self.dataset.train)?;
            let scores = self.evaluate(row, &*model)?;
            return results.write(row, None, scores, self.dataset);
        }
        if !finished {
            if self.no_training {
                return Ok(self.observer.note("not trained yet")?);
            }
            let trained = self.rows.get(trained_as).unwrap_or(row);
            if self.train_start(trained, trainings)? == Outcome::Stopped
                || self.train(trained)? == Outcome::Stopped
            {
                return Ok(());
            }
        }
        let scores = self.evaluate(row, &*run.trained_model(&row.config)?)?;
        results.write(row, Some(&run), scores, self.dataset)
    }

    /// The row whose weights another one starts from.
    pub(super) fn start_of(&self, row: &Row) -> Result<Option<(usize, &'a Row)>, ReproduceError> {
        let Some(name) = &row.config.start else {
            return Ok(None);
        };
        let mut rows = self.rows.iter().enumerate();
        let found = rows.find(|(_, other)| other.config.name == *name);
        let none = || {
            ReproduceError::Refused(format!(
                "{} starts from the weights of {name}, which is no row of the folder",
                row.folder
            ))
        };
        found.ok_or_else(none).map(Some)
    }

    /// Trains the row that another one starts from, where that is left.
    fn train_start(&self, row: &Row, trainings: &[Mutex<()>]) -> Result<Outcome, ReproduceError> {
        let Some((number, start)) = self.start_of(row)? else {
            return Ok(Outcome::Finished);
        };
        let training = trainings.get(number);
        let _held = training.map(|it| it.lock().unwrap_or_else(PoisonError::into_inner));
        match is_finished(self.run_of(start)?.manifest()?.as_ref()) {
            true => Ok(Outcome::Finished),
            false => self.train(start),
        }
    }

    fn train(&self, row: &Row) -> Result<Outcome, ReproduceError> {
        let start = match self.start_of(row)? {
            Some((_, start)) => {
                let run = self.run_of(start)?;
                Some(run.saved_weights(&start.config)?)
            }
            None => None,
        };
        let config = row.config.clone();
        let (dataset, threads) = (self.dataset, self.threads);
        let mut trainer = Trainer::from_weights(config, dataset, threads, start.as_ref())?;
        self.observer.training(&trainer)?;
        let run = RunFolder::resume(&self.runs.join(&row.folder), &row.config)?;
        let resumed = trainer.resume(&run)?;
        let mut step = self.observer.steps(row, &trainer, &resumed)?;
        let outcome = trainer.run(Some(&run), &mut |report| {
            step(report);
            match self.observer.stop_asked() {
                true => ControlFlow::Break(()),
                false => ControlFlow::Continue(()),
            }
        });
        Ok(outcome?)
    }

    fn evaluate(&self, row: &Row, model: &dyn Generator) -> Result<ProtocolScores, ReproduceError> {
        let pool = pool(self.threads).map_err(TrainingError::from)?;
        let mut scores = Vec::new();
        for protocol in row.config.protocols() {
            let evaluation =
                pool.install(|| self.observer.evaluate(&*protocol, model, self.dataset))?;
            for warning in &evaluation.warnings {
                self.observer.warning(warning);
            }
            scores.push((protocol.name(), evaluation.scores));
        }
        Ok(ProtocolScores::new(scores))
    }
}

pub(super) fn is_finished(manifest: Option<&Manifest>) -> bool {
    manifest.is_some_and(|manifest| manifest.state == RunState::Finished)
}

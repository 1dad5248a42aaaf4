//! Curves over the course of one training, or of several side by side.

use std::path::{Path, PathBuf};

use super::{ExperimentConfig, ReproduceError};
use crate::counted::counted;
use crate::evaluation::Metric;
use crate::evaluation::scores::AVERAGE;
use crate::report::{
    FigureError, Series, learning_rate_curve, loss_curve, thousands, total_losses_curve,
    validation_curve,
};
use crate::run::{LogLine, RunFolder, replace_file};

const LOSS: &str = "loss_curve.svg";
const VALIDATION: &str = "validation_curve.svg";
const LEARNING_RATE: &str = "learning_rate.svg";

/// What trainings logged.
pub struct Curves {
    runs: Vec<Course>,
}

/// One training.
struct Course {
    name: String,
    log: Vec<LogLine>,
    /// Those of its protocols, in their order.
    metrics: Vec<Metric>,
}

impl Curves {
    /// Files of a row's own curves, beside its scores.
    pub(super) const OF_ROW: [&str; 2] = [LOSS, VALIDATION];
    const ALL: [&str; 3] = [LOSS, VALIDATION, LEARNING_RATE];

    /// Those of one training.
    pub(super) fn of(name: &str, config: &ExperimentConfig, log: Vec<LogLine>) -> Self {
        let course = Course::of(name.into(), config, log);
        Self { runs: vec![course] }
    }

    /// Those of runs' folders, called as these are.
    ///
    /// # Errors
    /// A folder is no run's, or has no steps in its log; two have one name.
    pub fn read(folders: &[PathBuf]) -> Result<Self, ReproduceError> {
        let read = |folder: &PathBuf| {
            let run = RunFolder::open(folder);
            let (config, log) = (run.config()?, run.log()?);
            if log.is_empty() {
                return Err(ReproduceError::Refused(format!(
                    "{} has no training in its log",
                    folder.display()
                )));
            }
            let place = std::path::absolute(folder).unwrap_or_else(|_| folder.clone());
            let name = place.file_name().unwrap_or(folder.as_os_str());
            Ok(Course::of(name.to_string_lossy().into(), &config, log))
        };
        let runs = folders.iter().map(read);
        let runs: Vec<Course> = runs.collect::<Result<_, ReproduceError>>()?;
        for (index, run) in runs.iter().enumerate() {
            if runs[..index].iter().any(|other| other.name == run.name) {
                return Err(ReproduceError::Refused(format!(
                    "two of the runs are called {}; give one of them at a time",
                    run.name
                )));
            }
        }
        Ok(Self { runs })
    }

    /// The curves as SVG, by their files' names: losses (of one training its terms, too), the first
    /// metric on validation clips where there are scores, the learning rate.
    ///
    /// # Errors
    /// A loss or a score that is not finite.
    pub fn drawn(&self) -> Result<Vec<(&'static str, String)>, FigureError> {
        let mut drawn = vec![(LOSS, self.losses()?)];
        drawn.extend(self.validation()?.map(|curve| (VALIDATION, curve)));
        let rates = self.runs.iter().map(|run| Series {
            name: run.name.clone(),
            points: run.points(|line| Some(line.learning_rate)),
        });
        let title = self.title("Learning rate");
        let rates = learning_rate_curve(&title, &rates.collect::<Vec<_>>())?;
        drawn.push((LEARNING_RATE, rates));
        Ok(drawn)
    }

    /// Draws those of a run into its own folder, once it has logged steps.
    ///
    /// # Errors
    /// As [`Curves::drawn`]; the log cannot be read or a file not be written.
    pub fn write_into_run(
        run: &RunFolder,
        config: &ExperimentConfig,
    ) -> Result<(), ReproduceError> {
        let log = run.log()?;
        match log.is_empty() {
            true => Ok(()),
            false => Self::of(&config.name, config, log).write(run.path(), &Self::ALL),
        }
    }

    /// Writes some of them into a folder that is there.
    ///
    /// # Errors
    /// As [`Curves::drawn`]; a file cannot be written.
    pub(super) fn write(&self, folder: &Path, files: &[&str]) -> Result<(), ReproduceError> {
        for (name, curve) in self.drawn()? {
            if files.contains(&name) {
                replace_file(&folder.join(name), curve)?;
            }
        }
        Ok(())
    }

    /// Name and log of each training.
    #[cfg(feature = "cli")]
    pub(super) fn logs(&self) -> impl Iterator<Item = (&str, &[LogLine])> {
        self.runs.iter().map(|run| (&*run.name, &*run.log))
    }

    fn title(&self, what: &str) -> String {
        match &self.runs[..] {
            [run] => {
                let frame_steps = run.log.last().map_or(0, |last| last.frame_steps);
                let frame_steps = thousands(frame_steps);
                format!("{what} of {}, {frame_steps} frame-steps", run.name)
            }
            runs => format!("{what} of {}", counted(runs.len(), "training")),
        }
    }

    fn losses(&self) -> Result<String, FigureError> {
        let total = |run: &Course, name: &str| Series {
            name: name.into(),
            points: run.points(|line| Some(line.total)),
        };
        if let [run] = &self.runs[..] {
            let mut series = vec![total(run, "total")];
            let terms = run
                .log
                .last()
                .into_iter()
                .flat_map(|last| last.losses.keys());
            series.extend(terms.map(|term| Series {
                name: term.clone(),
                points: run.points(|line| line.losses.get(term).copied()),
            }));
            return loss_curve(&self.title("Losses"), &series);
        }
        let series = self.runs.iter().map(|run| total(run, &run.name));
        total_losses_curve(&self.title("Total losses"), &series.collect::<Vec<_>>())
    }

    /// Of one training every column of the metric; of several its average, or its first column.
    fn validation(&self) -> Result<Option<String>, FigureError> {
        let mut scored = self.runs.iter().filter_map(Course::scored);
        let Some((metric, columns)) = scored.next() else {
            return Ok(None);
        };
        let what = format!("{} on validation clips", metric.title);
        let mut title = self.title(&what);
        let series: Vec<Series> = match &self.runs[..] {
            [run] => {
                let columns = columns.iter().filter(|column| *column != AVERAGE);
                let series = columns.map(|column| Series {
                    name: format!("N = {column}"),
                    points: run.score(metric, column),
                });
                series.collect()
            }
            runs => {
                let average = columns.iter().find(|column| *column == AVERAGE);
                let Some(column) = average.or(columns.first()) else {
                    return Ok(None);
                };
                title.push_str(&format!(", {column}"));
                let of = runs.iter().map(|run| Series {
                    name: run.name.clone(),
                    points: run.score(metric, column),
                });
                of.collect()
            }
        };
        validation_curve(&title, metric, series).map(Some)
    }
}

impl Course {
    fn of(name: String, config: &ExperimentConfig, log: Vec<LogLine>) -> Self {
        let protocols = config.protocols();
        let metrics = protocols.iter().flat_map(|protocol| protocol.metrics());
        Self {
            name,
            log,
            metrics: metrics.cloned().collect(),
        }
    }

    fn points(&self, of: impl Fn(&LogLine) -> Option<f64>) -> Vec<(f64, f64)> {
        let point = |line: &LogLine| Some((line.frame_steps as f64, of(line)?));
        self.log.iter().filter_map(point).collect()
    }

    /// The first metric that validation scored, and its columns.
    fn scored(&self) -> Option<(&Metric, Vec<String>)> {
        let mut scores = self.log.iter().rev();
        let scores = scores.find_map(|line| line.validation.as_ref())?;
        self.metrics.iter().find_map(|metric| {
            let row = scores.row(metric.key)?;
            Some((metric, row.columns().map(String::from).collect()))
        })
    }

    fn score(&self, metric: &Metric, column: &str) -> Vec<(f64, f64)> {
        self.points(|line| line.validation.as_ref()?.row(metric.key)?.at(column))
    }
}

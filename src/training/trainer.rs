//! The loop: from a config and a data set to trained weights.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::best::Best;
use super::error::TrainingError;
use super::record::Record;
use super::report::StepReport;
use super::validation::Validation;
use crate::autograd::Parameters;
use crate::counted::counted;
use crate::data::{Dataset, file_digest};
use crate::experiment::ExperimentConfig;
use crate::models::settings::{InitialRng, TaskSetting};
use crate::models::weights::SavedWeights;
use crate::models::{Generator, ModelError, Streams, Task, weights};
use crate::nn::Initialiser;
use crate::optim::Adam;
use crate::ranks::{Identity, Ranks, Together, Traffic};
use crate::run::manifest::{self, Build};
use crate::run::{RunError, RunFolder, RunState};
use crate::step::{StepInput, Stepper};

/// A training: weights, optimiser and place in the schedule.
pub struct Trainer<'d> {
    pub(super) config: ExperimentConfig,
    /// The resolved config, TOML.
    pub(super) config_toml: String,
    pub(super) dataset: &'d Dataset,
    pub(super) task: Box<dyn Task<f32> + 'd>,
    pub(super) parameters: Parameters<f32>,
    pub(super) adam: Adam<f32>,
    pub(super) threads: usize,
    pub(super) frame_steps: u64,
    pub(super) validation: Option<Validation<'d>>,
    pub(super) best: Option<Best>,
    streams: Streams,
    pub(super) stepper: Stepper,
}

/// How a training ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The schedule is done.
    Finished,
    /// The observer asked to stop.
    Stopped,
}

impl<'d> Trainer<'d> {
    /// A training of the config's model from its initial weights, on `threads` threads.
    ///
    /// # Errors
    /// The config is not valid, its model has nothing to train, or the data is not what it can be
    /// trained on.
    pub fn new(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
    ) -> Result<Self, TrainingError> {
        Self::from_weights(config, dataset, threads, None)
    }

    /// The same from trained weights, those of the experiment that the config starts from.
    ///
    /// # Errors
    /// As [`Trainer::new`]; the weights are those of another model, or are missing.
    pub fn from_weights(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
        start: Option<&'d SavedWeights>,
    ) -> Result<Self, TrainingError> {
        let model = config.model.clone();
        Self::begin(config, dataset, threads, start, |setting, init| {
            model.task(setting, init)
        })
    }

    /// The same for a task that the config does not describe.
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn with_task(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
        task: impl FnOnce(
            &TaskSetting<'d>,
            &mut Initialiser<'_, f32, InitialRng>,
        ) -> Result<Box<dyn Task<f32> + 'd>, ModelError>,
    ) -> Result<Self, TrainingError> {
        Self::begin(config, dataset, threads, None, task)
    }

    fn begin(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
        start: Option<&'d SavedWeights>,
        task: impl FnOnce(
            &TaskSetting<'d>,
            &mut Initialiser<'_, f32, InitialRng>,
        ) -> Result<Box<dyn Task<f32> + 'd>, ModelError>,
    ) -> Result<Self, TrainingError> {
        match (&config.start, start) {
            (Some(name), None) => {
                return Err(TrainingError::Refused(format!(
                    "the config starts from the weights of {name}, and there are none: train {name}, \
                     then give its run's folder to --start"
                )));
            }
            (None, Some(start)) => {
                return Err(TrainingError::Refused(format!(
                    "{}: the config starts from drawn weights; name the experiment that these are of \
                     by the key start",
                    start.path.display()
                )));
            }
            _ => {}
        }
        config
            .validate()
            .map_err(|cause| TrainingError::Refused(format!("the config: {cause}")))?;
        let streams = Streams::new(config.seed);
        let mut parameters = Parameters::new();
        let setting = TaskSetting {
            dataset,
            data: config.data.clone(),
            streams,
            start,
        };
        let mut init = Initialiser::new(&mut parameters, streams.initialisation());
        let task = task(&setting, &mut init)?;
        if let Some(start) = start {
            let loaded = start.load_into(&mut parameters, &task.statistics());
            loaded.map_err(|error| TrainingError::Refused(format!("--start: {error}")))?;
        }
        Ok(Self {
            config_toml: config.to_toml().map_err(RunError::from)?,
            dataset,
            streams,
            adam: Adam::new(config.optimiser.clone(), &parameters)?
                .with_rate_groups(&parameters, |name| task.rate_group(name))
                .for_steps(task.steps()),
            task,
            parameters,
            stepper: Stepper::new(threads)?,
            threads,
            frame_steps: 0,
            validation: Validation::new(&config, dataset)?,
            best: None,
            config,
        })
    }

    pub fn config(&self) -> &ExperimentConfig {
        &self.config
    }

    /// What is trained.
    pub fn task(&self) -> &dyn Task<f32> {
        &*self.task
    }

    pub fn parameters(&self) -> &Parameters<f32> {
        &self.parameters
    }

    /// How large it is.
    pub fn summary(&self) -> String {
        let own = self.task.summary().map(|summary| format!("{summary}, "));
        format!(
            "{} parameters; {}{}, {} frame-steps; {}",
            self.parameters.weights(),
            own.unwrap_or_default(),
            counted(self.task.steps(), "step"),
            self.task.frame_steps(),
            match self.stepper.together.count() {
                1 => counted(self.threads, "thread"),
                ranks => format!(
                    "{} on each of {ranks} ranks",
                    counted(self.threads, "thread")
                ),
            }
        )
    }

    /// What a person should know before it begins: of the task, and threads that have nothing to
    /// do.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.task.warnings();
        let (shards, ranks) = (self.task.step(0).shards(), self.stepper.together.count());
        let idle = (self.threads * ranks).saturating_sub(shards);
        if idle > 0 {
            warnings.push(format!(
                "{} to do: a step has {} (schedule.shards), and a thread computes one at a time; give \
                 fewer threads, or a new training more shards",
                match idle {
                    1 => "1 thread has nothing".into(),
                    idle => format!("{idle} threads have nothing"),
                },
                counted(shards, "shard")
            ));
        }
        warnings
    }

    /// Steps done.
    pub fn steps_done(&self) -> u64 {
        self.adam.steps()
    }

    /// Frames trained so far.
    pub fn frame_steps_done(&self) -> u64 {
        self.frame_steps
    }

    /// SHA-256 of the weights as they are, hexadecimal.
    pub fn weights_digest(&self) -> String {
        weights::digest(&self.parameters)
    }

    /// The weights as they are, as the content of a weights file.
    ///
    /// # Errors
    /// See [`weights::to_safetensors`].
    pub fn weights_file(&self) -> Result<Vec<u8>, RunError> {
        let (statistics, config) = (self.task.statistics(), &self.config_toml);
        let file = weights::to_safetensors(&self.parameters, &statistics, config);
        Ok(file?)
    }

    /// The model with the weights as they are.
    pub fn model(&self) -> Box<dyn Generator> {
        self.task
            .generator(&self.config.name, self.parameters.clone())
    }

    /// Goes on together with other ranks, from where the first stands; it alone keeps a run's
    /// folder and scores the validation clips. The end has the bits of one process.
    ///
    /// # Errors
    /// Another rank has another program, config or data; then on every rank.
    pub fn join(&mut self, ranks: Arc<dyn Ranks>) -> Result<(), TrainingError> {
        let own = [
            ("program", Build::this().to_string()),
            ("instruction set", manifest::instructions()),
            ("config", self.config_toml.clone()),
            ("data", self.dataset.digest.clone()),
            ("start", self.statistics_digest()?),
        ];
        let own = own.map(|(name, value)| (name.to_owned(), value));
        let together = &mut self.stepper.together;
        *together = Together::new(ranks);
        Identity::agree(&together.share(Identity(own.to_vec()))?)?;
        let place = together.share((self.adam.steps(), self.frame_steps))?;
        let (steps, frame_steps) = place[0];
        let saved = self.parameters.saved_mut().map(|(_, values)| values);
        let mut moments = self.adam.moments().map(<[_]>::to_vec);
        for mut values in saved {
            if let Some(values) = values.as_slice_mut() {
                together.take_first(values);
            }
        }
        let moments_of_all = moments.iter_mut().flatten();
        moments_of_all.for_each(|moments| together.take_first(moments));
        self.frame_steps = frame_steps;
        let restored = self.adam.restore(steps, moments);
        restored.map_err(|_| TrainingError::Refused("moments of another model".into()))
    }

    /// SHA-256 of what the task knows of its data, that of a start among it.
    fn statistics_digest(&self) -> Result<String, RunError> {
        let none = Parameters::new();
        let file = weights::to_safetensors(&none, &self.task.statistics(), &self.config_toml)?;
        Ok(file_digest(&file))
    }

    /// What a step sends to other ranks and waits for them, so far.
    pub fn traffic(&self) -> Traffic {
        self.stepper.together.traffic()
    }

    /// Trains from where the training stands to the end of the schedule, or until `observe`, called
    /// after every step, breaks.
    ///
    /// With `out`, everything a run's folder holds is written there: a checkpoint at the intervals
    /// of the config, where it stops and at the end, and then the weights.
    ///
    /// # Errors
    /// A loss or gradient that is not finite ([`TrainingError::is_divergence`]; the checkpoints
    /// stay as they are), or a file that cannot be written.
    pub fn run(
        &mut self,
        out: Option<&RunFolder>,
        observe: &mut dyn FnMut(&StepReport) -> ControlFlow<()>,
    ) -> Result<Outcome, TrainingError> {
        let record = out.map(|run| Record::begin(run, self)).transpose();
        let mut record = self
            .stepper
            .together
            .agree(record.map_err(TrainingError::from))?;
        let steps = self.task.steps();
        while self.steps_done() < steps {
            let report = self.step().map(|report| self.score(report));
            let report = match report.and_then(|scored| self.stepper.together.agree(scored)) {
                Ok(report) => report,
                Err(error) => {
                    if let Some(record) = record.as_mut().filter(|_| error.is_divergence()) {
                        record.end(self, RunState::Diverged)?;
                    }
                    return Err(error);
                }
            };
            let kept = self.keep(&report, record.as_mut());
            self.stepper.together.agree(kept)?;
            let stopping = observe(&report).is_break() && report.step < steps;
            if self.stepper.together.any(stopping)? {
                if let Some(record) = &mut record {
                    record.save(self)?;
                    record.end(self, RunState::Stopped)?;
                }
                return Ok(Outcome::Stopped);
            }
        }
        if let Some(record) = &mut record {
            record.save(self)?;
            record.best_step = self.end_with_best();
            let weights = self.weights_file()?;
            record.run.write_weights(&weights)?;
            record.end(self, RunState::Finished)?;
            record.run.remove_best().map_err(RunError::from)?;
        } else {
            self.end_with_best();
        }
        Ok(Outcome::Finished)
    }

    /// Keeps what a step made: weights that are the best so far, a line of the log, a checkpoint.
    fn keep(
        &mut self,
        report: &StepReport,
        record: Option<&mut Record<'_>>,
    ) -> Result<(), TrainingError> {
        let validation = self.validation.as_ref().zip(report.validation.as_ref());
        let score = validation.and_then(|(by, scores)| by.deciding_score(scores));
        if let Some(score) = score {
            self.take_best(report.step, score, record.as_ref().map(|record| record.run))?;
        }
        if let Some(record) = record {
            record.step(self, report)?;
        }
        Ok(())
    }

    /// About how long the steps that are left take: as the one in their middle does, which is tried
    /// on copies of the weights and the optimiser. None where none is left, or it fails.
    pub fn expected(&mut self) -> Option<Duration> {
        let done = self.steps_done();
        let left = self
            .task
            .steps()
            .checked_sub(done)
            .filter(|&left| left > 0)?;
        let done = done + left / 2;
        let step = self.task.step(done);
        let input = StepInput {
            step: &*step,
            streams: self.streams,
            done,
        };
        let taken = self.stepper.trial(input, &self.parameters, &self.adam)?;
        let left = self.task.frame_steps().saturating_sub(self.frame_steps);
        let seconds = taken * left as f64 / step.frames().max(1) as f64;
        Duration::try_from_secs_f64(seconds).ok()
    }

    fn step(&mut self) -> Result<StepReport, TrainingError> {
        let start = Instant::now();
        let done = self.steps_done();
        let step = self.task.step(done);
        let learning_rate = self.adam.learning_rate();
        let input = StepInput {
            step: &*step,
            streams: self.streams,
            done,
        };
        let (stepper, adam) = (&mut self.stepper, &mut self.adam);
        let (losses, gradient_norm) = stepper.step(input, &mut self.parameters, adam)?;
        let frames = step.frames();
        self.frame_steps += frames;
        let seconds = start.elapsed().as_secs_f64();
        Ok(StepReport {
            step: done + 1,
            columns: step.columns(),
            total: losses.total,
            losses: losses.terms,
            watched: losses.watched,
            learning_rate,
            gradient_norm,
            frame_steps: self.frame_steps,
            seconds,
            frame_steps_per_second: frames as f64 / seconds.max(1e-9),
            validation: None,
        })
    }

    /// Scores the weights as they are on the validation clips where it is time to: on the first
    /// rank.
    fn score(&self, mut report: StepReport) -> Result<StepReport, TrainingError> {
        let first = self.stepper.together.is_first();
        let validation = self.validation.as_ref().filter(|_| first);
        let due = |it: &&Validation<'_>| it.is_due(report.step, self.task.steps());
        if let Some(validation) = validation.filter(due) {
            let model = self.model();
            let scores = self.stepper.install(|| validation.score(&*model));
            report.validation = Some(scores.map_err(|cause| {
                TrainingError::Refused(format!(
                    "step {} cannot be scored on the validation clips: {cause}",
                    report.step
                ))
            })?);
        }
        Ok(report)
    }
}

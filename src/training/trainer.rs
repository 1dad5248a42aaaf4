//! The loop: from a config and a data set to trained weights.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use rand::RngExt as _;

use super::error::TrainingError;
use super::step::{StepInput, StepPlan, StepReport, Stepper, TrainingWindows};
use crate::autograd::Parameters;
use crate::data::{DanceClip, Dataset};
use crate::experiment::config::ExperimentConfig;
use crate::experiment::layers::ConfigError;
use crate::models::streams::Streams;
use crate::models::transition::Standardisation;
use crate::models::transition::augmentation::Augmentation;
use crate::models::transition::schedule::{BatchPlan, Schedule};
use crate::models::transition::single_frames;
use crate::models::transition::{Feed, Network, TrainedModel};
use crate::models::{ModelError, weights};
use crate::nn::Initialiser;
use crate::optim::Adam;
use crate::run::checkpoint::{self, Checkpoint, CheckpointError};
use crate::run::folder::RunFolder;
use crate::run::log::Log;
use crate::run::manifest::{self, Manifest, RunState};
use crate::run::state::{self, Header};

/// What draws a model's initial weights.
pub type InitialRng = rand_chacha::ChaCha8Rng;

/// A training: weights, optimiser and place in the schedule.
pub struct Trainer<'d> {
    config: ExperimentConfig,
    /// The resolved config, and its SHA-256.
    config_toml: String,
    config_digest: String,
    dataset: &'d Dataset,
    augmentation: Augmentation,
    windows: TrainingWindows<'d>,
    streams: Streams,
    schedule: Schedule,
    network: Arc<dyn Network<f32>>,
    parameters: Parameters<f32>,
    adam: Adam<f32>,
    stepper: Stepper,
    threads: usize,
    frame_steps: u64,
}

/// How a training ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// The schedule is done.
    Finished,
    /// The observer asked to stop.
    Stopped,
}

/// Where a training goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resumed {
    /// Steps done; 0 where there was no checkpoint.
    pub steps: u64,
    /// Checkpoints that were newer and cannot be used, and why.
    pub damaged: Vec<String>,
}

impl<'d> Trainer<'d> {
    /// A training of the config's model from its initial weights, on `threads` threads.
    ///
    /// # Errors
    /// The config is not valid, its model has nothing to train, or the training clips are too short for its schedule.
    pub fn new(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
    ) -> Result<Self, TrainingError> {
        let model = config.model.clone();
        Self::with_network(config, dataset, threads, |init, standardisation| {
            model.build(init, standardisation)
        })
    }

    /// The same for a network that the config does not describe.
    ///
    /// # Errors
    /// As [`Trainer::new`].
    pub fn with_network(
        config: ExperimentConfig,
        dataset: &'d Dataset,
        threads: usize,
        build: impl FnOnce(
            &mut Initialiser<'_, f32, InitialRng>,
            &Standardisation,
        ) -> Result<Box<dyn Network<f32>>, ModelError>,
    ) -> Result<Self, TrainingError> {
        config.validate().map_err(|cause| ConfigError::Value {
            origin: "the config".into(),
            cause,
        })?;
        let config_toml = config.to_toml()?;
        let (augmentation, clips) = Augmentation::of(&dataset.train, &config)?;
        let streams = Streams::new(config.seed);
        let frames: Vec<usize> = dataset.train.iter().map(DanceClip::frames).collect();
        let schedule = Schedule::new(&frames, &config.schedule, streams);
        if schedule.steps() == 0 {
            return Err(TrainingError::NothingToTrain {
                min_len: config.schedule.min_len,
                max_len: config.schedule.max_len,
                fraction: config.schedule.fraction,
                clips: frames.len(),
                longest: frames.iter().copied().max().unwrap_or(0),
            });
        }
        let root_frame = config.model.root_frame();
        // Of the longest transitions that are trained.
        let longest = frames.iter().map(|frames| frames.saturating_sub(1)).max();
        let transition = config.schedule.max_len.min(longest.unwrap_or(0));
        let measured = &clips[..augmentation.at_recorded_tempo()];
        let views = measured.iter().map(|clip| clip.features.view());
        let standardisation = root_frame.standardisation(views, transition);
        if let Some(validation) = &config.validation {
            validation.check(dataset)?;
        }
        let mut parameters = Parameters::new();
        let mut init = Initialiser::new(&mut parameters, streams.initialisation());
        let network: Arc<dyn Network<f32>> = build(&mut init, &standardisation)?.into();
        Ok(Self {
            config_digest: checkpoint::file_digest(config_toml.as_bytes()),
            config_toml,
            windows: TrainingWindows {
                clips,
                standardisation,
                root_frame,
            },
            augmentation,
            streams,
            schedule,
            adam: Adam::new(config.optimiser, &parameters, |name| {
                network.in_transformer(name)
            }),
            network,
            stepper: Stepper::new(&parameters, config.schedule.shards, threads)?,
            parameters,
            threads,
            frame_steps: 0,
            dataset,
            config,
        })
    }

    pub fn config(&self) -> &ExperimentConfig {
        &self.config
    }

    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    pub fn parameters(&self) -> &Parameters<f32> {
        &self.parameters
    }

    pub fn standardisation(&self) -> &Standardisation {
        &self.windows.standardisation
    }

    /// Steps done.
    pub fn steps_done(&self) -> u64 {
        self.adam.steps()
    }

    /// Frames predicted so far.
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
    pub fn weights_file(&self) -> Result<Vec<u8>, TrainingError> {
        let statistics = &self.windows.standardisation;
        Ok(weights::to_safetensors(
            &self.parameters,
            statistics,
            &self.config_toml,
        )?)
    }

    /// The model with the weights as they are.
    pub fn model(&self) -> TrainedModel {
        TrainedModel::new(
            self.config.name.clone(),
            self.network.clone(),
            self.parameters.clone(),
            self.windows.standardisation.clone(),
            self.windows.root_frame,
        )
    }

    /// Takes up the newest whole checkpoint of a run; the damaged ones after it are set aside. Without any checkpoint the training
    /// is at its beginning.
    ///
    /// # Errors
    /// The run is of another config, other data or another model, or there are checkpoints but none is whole.
    pub fn resume(&mut self, run: &RunFolder) -> Result<Resumed, TrainingError> {
        self.resume_newest(run)
            .map_err(|error| run.or_other_version(error))
    }

    fn resume_newest(&mut self, run: &RunFolder) -> Result<Resumed, TrainingError> {
        let mut damaged = Vec::new();
        let mut aside: Vec<PathBuf> = Vec::new();
        for (_, path) in checkpoint::list(&run.checkpoints())?.into_iter().rev() {
            match Checkpoint::read(&path, &self.parameters) {
                Ok(checkpoint) => {
                    self.take_up(checkpoint, &path)?;
                    for path in &aside {
                        checkpoint::set_aside(path)?;
                    }
                    return Ok(Resumed {
                        steps: self.steps_done(),
                        damaged,
                    });
                }
                Err(problem) => {
                    damaged.push(problem.to_string());
                    aside.push(path);
                }
            }
        }
        if damaged.is_empty() {
            Ok(Resumed { steps: 0, damaged })
        } else {
            Err(TrainingError::NoCheckpoint {
                path: run.path().into(),
                problems: damaged,
            })
        }
    }

    fn take_up(&mut self, checkpoint: Checkpoint, path: &Path) -> Result<(), TrainingError> {
        let Header {
            steps,
            epoch,
            position,
            frame_steps,
            config_digest,
            data_digest,
            ..
        } = checkpoint.header;
        // Another version may write the same config with more keys.
        if config_digest != self.config_digest
            && ExperimentConfig::parse(&checkpoint.weights.config, "the checkpoint's config")?
                != self.config
        {
            return Err(TrainingError::OtherRun {
                path: path.into(),
                saved: config_digest,
                found: self.config_digest.clone(),
            });
        }
        if data_digest != self.dataset.digest {
            return Err(TrainingError::OtherData {
                path: path.into(),
                saved: data_digest,
                found: self.dataset.digest.clone(),
            });
        }
        let misfit = |problem: String| TrainingError::Checkpoint {
            path: path.into(),
            problem: CheckpointError::Misfit { problem },
        };
        let place = self.schedule.place(steps);
        if steps > self.schedule.steps() || (place.0 as u64, place.1 as u64) != (epoch, position) {
            return Err(misfit(format!(
                "step {steps} at batch {position} of epoch {epoch}, where the schedule has batch {} of epoch {}",
                place.1, place.0
            )));
        }
        checkpoint
            .weights
            .load_into(&mut self.parameters)
            .map_err(|error| TrainingError::Checkpoint {
                path: path.into(),
                problem: error.into(),
            })?;
        self.adam
            .restore(steps, checkpoint.moments)
            .map_err(|_| misfit("its moments have other sizes than the weights".into()))?;
        self.frame_steps = frame_steps;
        Ok(())
    }

    /// Trains from where the training stands to the end of the schedule, or until `observe`, called after every step, breaks.
    ///
    /// With `out`, everything a run's folder holds is written there: a checkpoint at the intervals of the config, where it stops
    /// and at the end, and then the weights.
    ///
    /// # Errors
    /// A loss or gradient that is not finite ([`TrainingError::NonFinite`]; the checkpoints stay as they are), or a file that cannot
    /// be written.
    pub fn run(
        &mut self,
        out: Option<&RunFolder>,
        observe: &mut dyn FnMut(&StepReport) -> ControlFlow<()>,
    ) -> Result<Outcome, TrainingError> {
        let mut record = out.map(|run| Record::begin(run, self)).transpose()?;
        let (first, mut position) = self.schedule.place(self.steps_done());
        for epoch in first..self.schedule.epochs() {
            let batches = self.schedule.epoch(epoch);
            for plan in batches.iter().skip(std::mem::take(&mut position)) {
                let report = match self.step(epoch, plan).and_then(|step| self.score(step)) {
                    Ok(report) => report,
                    Err(error) => {
                        if let (TrainingError::NonFinite { .. }, Some(record)) =
                            (&error, &mut record)
                        {
                            record.end(self, RunState::Diverged)?;
                        }
                        return Err(error);
                    }
                };
                if let Some(record) = &mut record {
                    record.step(self, &report)?;
                }
                if observe(&report).is_break() && report.step < self.schedule.steps() {
                    if let Some(record) = &mut record {
                        record.save(self)?;
                        record.end(self, RunState::Stopped)?;
                    }
                    return Ok(Outcome::Stopped);
                }
            }
        }
        if let Some(record) = &mut record {
            record.save(self)?;
            record.run.write_weights(&self.weights_file()?)?;
            record.end(self, RunState::Finished)?;
        }
        Ok(Outcome::Finished)
    }

    fn step(&mut self, epoch: usize, batch: &BatchPlan) -> Result<StepReport, TrainingError> {
        let start = Instant::now();
        let step = self.steps_done();
        let plan = &self.plan(batch, step);
        let beta = self
            .schedule
            .teacher_forcing(&self.config.scheduled_sampling, step);
        let drawn = if self.streams.sampling(step).random::<f64>() < beta {
            Feed::GroundTruth
        } else {
            Feed::Predictions
        };
        let feed = self.network.feed(drawn);
        let input = StepInput {
            network: self.network.as_ref(),
            windows: &self.windows,
            streams: self.streams,
            step,
            plan,
            feed,
            learning_rate: self
                .config
                .optimiser
                .learning_rate_at(step, self.schedule.steps()),
        };
        let learning_rate = input.learning_rate;
        let (losses, gradient_norm) =
            self.stepper
                .step(&input, &mut self.parameters, &mut self.adam)?;
        let frames = (plan.windows.len() * plan.length) as u64;
        self.frame_steps += frames;
        let seconds = start.elapsed().as_secs_f64();
        Ok(StepReport {
            step: step + 1,
            epoch,
            length: plan.length,
            batch: plan.windows.len(),
            feed,
            beta,
            total: losses.total,
            losses: losses.terms,
            learning_rate,
            gradient_norm,
            frame_steps: self.frame_steps,
            seconds,
            frame_steps_per_second: frames as f64 / seconds.max(1e-9),
            validation: None,
        })
    }

    /// A batch of the schedule with the single frames of its step, all these windows in a form that
    /// `[augmentation]` allows.
    fn plan(&self, batch: &BatchPlan, step: u64) -> StepPlan {
        let count = self.network.single_frames();
        let mut plan = StepPlan {
            length: batch.length,
            windows: batch.windows.clone(),
            single_frames: single_frames::draw(
                self.schedule.clip_frames(),
                count,
                &mut self.streams.single_frames(step),
            ),
        };
        let clips = &self.windows.clips;
        self.augmentation
            .vary(&mut plan, clips, &self.streams, step);
        plan
    }

    /// Scores the weights as they are on the validation clips where it is time to.
    fn score(&self, mut report: StepReport) -> Result<StepReport, TrainingError> {
        let last = report.step == self.schedule.steps();
        if let Some(validation) = &self.config.validation
            && (report.step.is_multiple_of(validation.every_steps) || last)
        {
            let model = self.model();
            let scores = self
                .stepper
                .install(|| validation.score(&model, self.dataset));
            report.validation = Some(scores.map_err(|cause| TrainingError::Validation {
                step: report.step,
                cause: Box::new(cause),
            })?);
        }
        Ok(report)
    }

    /// The content of a state file that belongs to a weights file.
    fn state_file(&self, weights: &[u8]) -> Result<Vec<u8>, TrainingError> {
        let (epoch, position) = self.schedule.place(self.steps_done());
        let header = Header {
            steps: self.steps_done(),
            epoch: epoch as u64,
            position: position as u64,
            frame_steps: self.frame_steps,
            config_digest: self.config_digest.clone(),
            data_digest: self.dataset.digest.clone(),
            weights_file_digest: checkpoint::file_digest(weights),
        };
        Ok(state::encode(&header, self.adam.moments())?)
    }
}

/// What a run writes while it goes on.
struct Record<'r> {
    run: &'r RunFolder,
    log: Log,
    manifest: Manifest,
    /// Wall-clock time before this process took the run up.
    seconds_before: f64,
    start: Instant,
    /// Steps of the newest checkpoint.
    saved: Option<u64>,
}

impl<'r> Record<'r> {
    fn begin(run: &'r RunFolder, trainer: &Trainer<'_>) -> Result<Self, TrainingError> {
        let newest = checkpoint::list(&run.checkpoints())?.pop();
        let mut manifest = Manifest::new(
            &trainer.config,
            trainer.dataset,
            &trainer.schedule,
            trainer.parameters.weights(),
            trainer.threads,
        );
        let mut seconds_before = 0.0;
        if let Some(earlier) = run.manifest()? {
            manifest.started = earlier.started;
            seconds_before = earlier.seconds;
        }
        let mut record = Self {
            run,
            log: Log::open(run.log_path(), trainer.steps_done())?,
            manifest,
            seconds_before,
            start: Instant::now(),
            saved: newest.map(|(step, _)| step),
        };
        record.describe(trainer, RunState::Running)?;
        Ok(record)
    }

    fn step(&mut self, trainer: &Trainer<'_>, report: &StepReport) -> Result<(), TrainingError> {
        let config = &trainer.config;
        let last = report.step == trainer.schedule.steps();
        if report.step.is_multiple_of(config.log.every_steps) || last || report.validation.is_some()
        {
            self.log.write(report)?;
        }
        if report.step.is_multiple_of(config.checkpoint.every_steps) {
            self.save(trainer)?;
            self.describe(trainer, RunState::Running)?;
        }
        Ok(())
    }

    /// Writes a checkpoint, unless the newest is of this step.
    fn save(&mut self, trainer: &Trainer<'_>) -> Result<(), TrainingError> {
        let steps = trainer.steps_done();
        if self.saved != Some(steps) {
            self.log.sync()?;
            let weights = trainer.weights_file()?;
            let state = trainer.state_file(&weights)?;
            let keep = trainer.config.checkpoint.keep;
            checkpoint::write(&self.run.checkpoints(), steps, &weights, &state, keep)?;
            self.saved = Some(steps);
        }
        Ok(())
    }

    fn end(&mut self, trainer: &Trainer<'_>, state: RunState) -> Result<(), TrainingError> {
        self.log.sync()?;
        self.manifest.finished = Some(manifest::now());
        if state == RunState::Finished {
            self.manifest.weights_digest = Some(trainer.weights_digest());
        }
        self.describe(trainer, state)
    }

    fn describe(&mut self, trainer: &Trainer<'_>, state: RunState) -> Result<(), TrainingError> {
        self.manifest.state = state;
        self.manifest.steps_done = trainer.steps_done();
        self.manifest.frame_steps_done = trainer.frame_steps;
        self.manifest.seconds = self.seconds_before + self.start.elapsed().as_secs_f64();
        self.run.write_manifest(&self.manifest)
    }
}

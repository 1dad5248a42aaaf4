//! What a run writes while it goes on: log, manifest, checkpoints.

use std::time::Instant;

use super::report::StepReport;
use super::trainer::Trainer;
use crate::data::file_digest;
use crate::run::checkpoint;
use crate::run::log::Log;
use crate::run::manifest::{self, Manifest};
use crate::run::state::{self, Header};
use crate::run::{RunError, RunFolder, RunState};

pub(super) struct Record<'r> {
    pub run: &'r RunFolder,
    log: Log,
    manifest: Manifest,
    /// Wall-clock time before this process took the run up.
    seconds_before: f64,
    start: Instant,
    /// Steps of the newest checkpoint.
    saved: Option<u64>,
    /// The step that the weights at the end are of, where it is not the last.
    pub best_step: Option<u64>,
}

impl<'r> Record<'r> {
    pub fn begin(run: &'r RunFolder, trainer: &Trainer<'_>) -> Result<Self, RunError> {
        let newest = checkpoint::list(&run.checkpoints())?.pop();
        let mut manifest = Manifest::new(
            &trainer.config,
            trainer.dataset,
            &*trainer.task,
            trainer.parameters.weights(),
            (trainer.stepper.together.count(), trainer.threads),
        );
        let mut seconds_before = 0.0;
        if let Some(earlier) = run.manifest()? {
            manifest.started = earlier.started;
            if trainer.steps_done() > 0 {
                let before = earlier.instructions.into_iter();
                manifest.instructions = before.chain(manifest.instructions).collect();
                manifest.instructions.dedup();
            }
            seconds_before = earlier.seconds;
        }
        let mut record = Self {
            run,
            log: Log::open(run.log_path(), trainer.steps_done())?,
            manifest,
            seconds_before,
            start: Instant::now(),
            saved: newest.map(|(step, _)| step),
            best_step: None,
        };
        record.describe(trainer, RunState::Running)?;
        Ok(record)
    }

    pub fn step(&mut self, trainer: &Trainer<'_>, report: &StepReport) -> Result<(), RunError> {
        let config = &trainer.config;
        let last = report.step == trainer.task.steps();
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
    pub fn save(&mut self, trainer: &Trainer<'_>) -> Result<(), RunError> {
        let steps = trainer.steps_done();
        if self.saved == Some(steps) {
            return Ok(());
        }
        self.run.check_is_there()?;
        self.log.sync()?;
        let weights = trainer.weights_file()?;
        let [epoch, position] = trainer.task.place(steps);
        let header = Header {
            steps,
            epoch,
            position,
            frame_steps: trainer.frame_steps,
            config_digest: file_digest(trainer.config_toml.as_bytes()),
            data_digest: trainer.dataset.digest.clone(),
            weights_file_digest: file_digest(&weights),
        };
        let state = state::encode(&header, trainer.adam.moments())?;
        let keep = trainer.config.checkpoint.keep;
        checkpoint::write(&self.run.checkpoints(), steps, &weights, &state, keep)?;
        self.saved = Some(steps);
        Ok(())
    }

    pub fn end(&mut self, trainer: &Trainer<'_>, state: RunState) -> Result<(), RunError> {
        self.log.sync()?;
        self.manifest.finished = Some(manifest::now());
        if state == RunState::Finished {
            self.manifest.weights_digest = Some(trainer.weights_digest());
            self.manifest.weights_file_digest = Some(file_digest(&trainer.weights_file()?));
            self.manifest.best_step = self.best_step;
        }
        self.describe(trainer, state)
    }

    fn describe(&mut self, trainer: &Trainer<'_>, state: RunState) -> Result<(), RunError> {
        self.manifest.state = state;
        self.manifest.steps_done = trainer.steps_done();
        self.manifest.frame_steps_done = trainer.frame_steps;
        self.manifest.seconds = self.seconds_before + self.start.elapsed().as_secs_f64();
        Ok(self.run.write_manifest(&self.manifest)?)
    }
}

//! Taking a training up where a checkpoint left it.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use super::error::TrainingError;
use super::trainer::Trainer;
use crate::data::file_digest;
use crate::run::checkpoint::{self, Checkpoint};
use crate::run::{RunError, RunFolder, manifest};

/// Where a training goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resumed {
    /// Steps done; 0 where there was no checkpoint.
    pub steps: u64,
    /// Checkpoints that were newer and cannot be used, and why.
    pub damaged: Vec<String>,
    /// That the end will have other bits than without the break, and why; none where it will not.
    pub other_bits: Option<String>,
}

impl Resumed {
    /// What is to be known of going on there.
    pub fn warnings(&self) -> Vec<String> {
        let damaged = self.damaged.iter();
        let left_out = damaged.map(|why| format!("a newer checkpoint is left out: {why}"));
        left_out.chain(self.other_bits.clone()).collect()
    }
}

impl Trainer<'_> {
    /// Takes up the newest whole checkpoint of a run; the damaged ones after it are set aside.
    /// Without any checkpoint the training is at its beginning.
    ///
    /// # Errors
    /// The run is of another config, other data or another model, or there are checkpoints but none
    /// is whole.
    pub fn resume(&mut self, run: &RunFolder) -> Result<Resumed, TrainingError> {
        let resumed = self.resume_newest(run);
        let resumed = resumed.map_err(|error| run.or_other_version(error))?;
        self.resume_best(run)?;
        Ok(resumed)
    }

    /// What is to be known where the steps so far were computed with another instruction set.
    fn other_bits(&self, run: &RunFolder) -> Result<Option<String>, RunError> {
        let manifest = run.manifest()?;
        let last = manifest.as_ref().and_then(|it| it.instructions.last());
        let now = manifest::instructions();
        let other = last.filter(|last| **last != now && self.steps_done() > 0);
        Ok(other.map(|last| {
            format!(
                "the steps so far were computed with the instruction set {last}, those to come \
                 with {now}: the end will not have the bits of a training on one CPU"
            )
        }))
    }

    fn resume_newest(&mut self, run: &RunFolder) -> Result<Resumed, RunError> {
        let mut damaged = Vec::new();
        let mut aside: Vec<PathBuf> = Vec::new();
        for (_, path) in checkpoint::list(&run.checkpoints())?.into_iter().rev() {
            match Checkpoint::read(&path, &self.parameters) {
                Ok(checkpoint) => {
                    self.take_up(checkpoint, &path, run)?;
                    for path in &aside {
                        checkpoint::set_aside(path)?;
                    }
                    return Ok(Resumed {
                        steps: self.steps_done(),
                        damaged,
                        other_bits: self.other_bits(run)?,
                    });
                }
                Err(problem) => {
                    damaged.push(problem.to_string());
                    aside.push(path);
                }
            }
        }
        match damaged.is_empty() {
            true => Ok(Resumed {
                steps: 0,
                damaged,
                other_bits: None,
            }),
            false => Err(RunError::Refused(format!(
                "no checkpoint of {} can be used: {}",
                run.path().display(),
                damaged.join("; ")
            ))),
        }
    }

    fn take_up(
        &mut self,
        checkpoint: Checkpoint,
        path: &Path,
        run: &RunFolder,
    ) -> Result<(), RunError> {
        let Checkpoint {
            header,
            moments,
            weights,
        } = checkpoint;
        let digest = file_digest(self.config_toml.as_bytes());
        // Another version may write the same config with more keys.
        if header.config_digest != digest && run.config_of(&weights)? != self.config {
            return Err(RunError::Refused(format!(
                "{} belongs to a config with digest {}, the run's config has digest {digest}",
                path.display(),
                header.config_digest
            )));
        }
        RunFolder::check_data(path, &header.data_digest, &self.dataset.digest)?;
        let misfit = |problem: &dyn Display| {
            RunError::Refused(format!(
                "{} does not fit the model: {problem}",
                path.display()
            ))
        };
        let (steps, found) = (header.steps, [header.epoch, header.position]);
        let place = self.task.place(steps);
        if steps > self.task.steps() || place != found {
            return Err(misfit(&format_args!(
                "step {steps} at batch {} of epoch {}, where the schedule has batch {} of epoch {}",
                found[1], found[0], place[1], place[0]
            )));
        }
        weights
            .load_into(&mut self.parameters, &self.task.statistics())
            .map_err(|error| misfit(&error))?;
        self.adam
            .restore(steps, moments)
            .map_err(|_| misfit(&"its moments have other sizes than the weights"))?;
        self.frame_steps = header.frame_steps;
        Ok(())
    }
}

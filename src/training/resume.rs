//! Taking a training up where a checkpoint left it.

use std::path::{Path, PathBuf};

use super::trainer::Trainer;
use crate::experiment::ExperimentConfig;
use crate::run::checkpoint::{self, Checkpoint, CheckpointError};
use crate::run::state::Header;
use crate::run::{RunError, RunFolder};

/// Where a training goes on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resumed {
    /// Steps done; 0 where there was no checkpoint.
    pub steps: u64,
    /// Checkpoints that were newer and cannot be used, and why.
    pub damaged: Vec<String>,
}

impl Trainer<'_> {
    /// Takes up the newest whole checkpoint of a run; the damaged ones after it are set aside. Without any checkpoint the
    /// training is at its beginning.
    ///
    /// # Errors
    /// The run is of another config, other data or another model, or there are checkpoints but none is whole.
    pub fn resume(&mut self, run: &RunFolder) -> Result<Resumed, RunError> {
        self.resume_newest(run)
            .map_err(|error| run.or_other_version(error))
    }

    fn resume_newest(&mut self, run: &RunFolder) -> Result<Resumed, RunError> {
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
            Err(RunError::NoCheckpoint {
                path: run.path().into(),
                problems: damaged,
            })
        }
    }

    fn take_up(&mut self, checkpoint: Checkpoint, path: &Path) -> Result<(), RunError> {
        let Header {
            steps,
            epoch,
            position,
            frame_steps,
            config_digest,
            data_digest,
            ..
        } = checkpoint.header;
        let own_digest = checkpoint::file_digest(self.config_toml.as_bytes());
        // Another version may write the same config with more keys.
        if config_digest != own_digest
            && ExperimentConfig::parse(&checkpoint.weights.config, "the checkpoint's config")?
                != self.config
        {
            return Err(RunError::OtherRun {
                path: path.into(),
                saved: config_digest,
                found: own_digest,
            });
        }
        if data_digest != self.dataset.digest {
            return Err(RunError::OtherData {
                path: path.into(),
                saved: data_digest,
                found: self.dataset.digest.clone(),
            });
        }
        let misfit = |problem: String| RunError::Checkpoint {
            path: path.into(),
            problem: CheckpointError::Misfit { problem },
        };
        let place = self.task.place(steps);
        if steps > self.task.steps() || place != [epoch, position] {
            return Err(misfit(format!(
                "step {steps} at batch {position} of epoch {epoch}, where the schedule has batch {} of epoch {}",
                place[1], place[0]
            )));
        }
        let statistics = self.task.statistics();
        checkpoint
            .weights
            .load_into(&mut self.parameters, &statistics)
            .map_err(|error| RunError::Checkpoint {
                path: path.into(),
                problem: error.into(),
            })?;
        self.adam
            .restore(steps, checkpoint.moments)
            .map_err(|_| misfit("its moments have other sizes than the weights".into()))?;
        self.frame_steps = frame_steps;
        Ok(())
    }
}

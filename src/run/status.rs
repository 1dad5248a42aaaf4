//! How a run stands, from what lies in its folder.

use super::checkpoint;
use super::error::RunError;
use super::folder::RunFolder;
use super::lock::FolderLock;
use super::log;
use super::manifest::{Manifest, RunState};

/// How a run stands at this moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunStatus {
    /// A training writes to the folder.
    Running,
    /// Stopped on request: goes on from where it stopped.
    Stopped,
    /// Ended without a word, killed or by an error: goes on from its newest checkpoint.
    Interrupted,
    /// A loss or gradient was not finite.
    Diverged,
    Finished,
}

/// How far a run got.
#[derive(Debug, Clone, PartialEq)]
pub struct RunProgress {
    pub status: RunStatus,
    /// Of an interrupted run: those that are saved.
    pub steps_done: u64,
    pub frame_steps_done: u64,
    /// Frames predicted in a second of wall-clock time; of a run that runs, in its last step.
    pub frame_steps_per_second: Option<f64>,
    pub manifest: Manifest,
}

impl RunFolder {
    /// How the run stands; none where no training has begun.
    ///
    /// # Errors
    /// The manifest is damaged, or the folder cannot be read.
    pub fn progress(&self) -> Result<Option<RunProgress>, RunError> {
        let Some(manifest) = self.manifest()? else {
            return Ok(None);
        };
        let status = match manifest.state {
            RunState::Stopped => RunStatus::Stopped,
            RunState::Diverged => RunStatus::Diverged,
            RunState::Finished => RunStatus::Finished,
            RunState::Running if FolderLock::is_taken(self.path()) => RunStatus::Running,
            RunState::Running => RunStatus::Interrupted,
        };
        let logged = match status {
            // The manifest is as old as its newest checkpoint.
            RunStatus::Running => log::last(&self.log_path()),
            _ => None,
        };
        let mean = manifest.frame_steps_done as f64 / manifest.seconds;
        let mut progress = RunProgress {
            status,
            steps_done: manifest.steps_done,
            frame_steps_done: manifest.frame_steps_done,
            frame_steps_per_second: (mean > 0.0 && mean.is_finite()).then_some(mean),
            manifest,
        };
        if let Some(line) = logged {
            progress.steps_done = line.step;
            progress.frame_steps_done = line.frame_steps;
            progress.frame_steps_per_second = Some(line.frame_steps_per_second);
        }
        if status == RunStatus::Interrupted {
            let newest = checkpoint::list(&self.checkpoints())?.pop();
            progress.steps_done = newest.map_or(0, |(step, _)| step);
        }
        Ok(Some(progress))
    }
}

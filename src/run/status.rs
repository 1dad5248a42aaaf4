//! How a run stands, from what lies in its folder.

use super::checkpoint;
use super::error::RunError;
use super::folder::RunFolder;
use super::lock::FolderLock;
use super::log;
use super::manifest::{Manifest, RunState};

/// How far a run got.
#[derive(Debug, Clone, PartialEq)]
pub struct RunProgress {
    /// Whether a training writes to the folder at this moment.
    pub is_running: bool,
    /// Of a run that was interrupted, killed or ended by an error: those that are saved.
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
        let unended = manifest.state == RunState::Running;
        let is_running = unended && FolderLock::is_taken(self.path());
        let mean = manifest.frame_steps_done as f64 / manifest.seconds;
        let mut progress = RunProgress {
            is_running,
            steps_done: manifest.steps_done,
            frame_steps_done: manifest.frame_steps_done,
            frame_steps_per_second: (mean > 0.0 && mean.is_finite()).then_some(mean),
            manifest,
        };
        // The manifest is as old as its newest checkpoint.
        if is_running && let Some(line) = log::last(&self.log_path()) {
            progress.steps_done = line.step;
            progress.frame_steps_done = line.frame_steps;
            progress.frame_steps_per_second = Some(line.frame_steps_per_second);
        }
        if unended && !is_running {
            let newest = checkpoint::list(&self.checkpoints())?.pop();
            progress.steps_done = newest.map_or(0, |(step, _)| step);
        }
        Ok(Some(progress))
    }
}

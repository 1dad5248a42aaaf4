//! How far a training has come, on stderr.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use super::notice::notice;
use crate::models::Task;
use crate::training::StepReport;

/// Time between two lines where there is no terminal for a progress bar.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A bar on a terminal, a line now and then elsewhere.
pub struct Progress {
    bar: Option<ProgressBar>,
    /// What lines begin with.
    name: String,
    steps: u64,
    frame_steps: u64,
    begun: Instant,
    /// Frames predicted before this process.
    before: u64,
    line: Option<Instant>,
}

impl Progress {
    /// `before`: frames that earlier processes predicted of the schedule's.
    pub fn new(task: &dyn Task<f32>, before: u64) -> Self {
        let mut progress = Self::lines(String::new(), task, before);
        progress.bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}");
            ProgressBar::new(task.frame_steps())
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
                .with_position(before)
        });
        progress
    }

    /// Lines that begin with a name, for a training that is not the only one; `before` as in
    /// [`Progress::new`].
    pub fn lines(name: String, task: &dyn Task<f32>, before: u64) -> Self {
        Self {
            bar: None,
            name,
            steps: task.steps(),
            frame_steps: task.frame_steps(),
            begun: Instant::now(),
            before,
            line: None,
        }
    }

    /// Shows a step that is done.
    pub fn step(&mut self, report: &StepReport) {
        // Of this process alone: what an earlier one did took none of its time.
        let done = (report.frame_steps - self.before) as f64;
        let rate = done / self.begun.elapsed().as_secs_f64().max(1e-9);
        let left = (self.frame_steps - report.frame_steps) as f64 / rate.max(1e-9);
        let length = report
            .column("length")
            .map(|length| format!("  N {length}"));
        let length = length.unwrap_or_default();
        let what = format!(
            "{}step {}/{}{length}  loss {:.4}  {rate:.0} frames/s  {} left",
            self.name,
            report.step,
            self.steps,
            report.total,
            HumanDuration(Duration::from_secs(left as u64))
        );
        if let Some(bar) = &self.bar {
            bar.set_message(what);
            bar.set_position(report.frame_steps);
            return;
        }
        if self.line.is_none_or(|last| last.elapsed() >= LINE_EVERY) || report.step == self.steps {
            self.line = Some(Instant::now());
            notice(what);
        }
    }
}

impl Drop for Progress {
    /// Leaves the bar as it is.
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.abandon();
        }
    }
}

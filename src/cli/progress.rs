//! How far a command has come, on stderr.

use std::io::IsTerminal as _;
use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use super::notice::notice;
use crate::models::Task;
use crate::report::thousands;
use crate::training::StepReport;

/// Time between two lines where there is no terminal for a progress bar.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A bar on a terminal, a line now and then elsewhere.
pub struct Meter {
    bar: Option<ProgressBar>,
    line: Option<Instant>,
    begun: Instant,
    /// Done before this process, and in all.
    before: u64,
    all: u64,
}

impl Meter {
    /// From `before` to `all`; a bar only where nothing else is shown at the same time.
    pub fn new(all: u64, before: u64, alone: bool) -> Self {
        let drawn = alone && std::io::stderr().is_terminal();
        let bar = drawn.then(|| {
            let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}");
            ProgressBar::new(all)
                .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
                .with_position(before)
        });
        Self {
            bar,
            line: None,
            begun: Instant::now(),
            before,
            all,
        }
    }

    /// Done a second in this process, and how long the rest takes at that.
    pub fn speed(&self, done: u64) -> (f64, HumanDuration) {
        let rate = (done - self.before) as f64 / self.begun.elapsed().as_secs_f64().max(1e-9);
        let left = self.all.saturating_sub(done) as f64 / rate.max(1e-9);
        (rate, HumanDuration(Duration::from_secs(left as u64)))
    }

    /// "1,000 of 2,000 frames".
    pub fn share(&self, done: u64) -> String {
        format!("{} of {} frames", thousands(done), thousands(self.all))
    }

    /// Shows how far it is.
    pub fn show(&mut self, done: u64, what: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(what.to_owned());
            bar.set_position(done);
        } else if self.line.is_none_or(|last| last.elapsed() >= LINE_EVERY) || done == self.all {
            self.line = Some(Instant::now());
            notice(what);
        }
    }

    /// Ends without a trace of the bar.
    pub fn clear(&mut self) {
        if let Some(bar) = self.bar.take() {
            bar.finish_and_clear();
        }
    }
}

impl Drop for Meter {
    /// Leaves the bar as it is.
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.abandon();
        }
    }
}

/// How far a training has come.
pub struct Progress {
    meter: Meter,
    /// What its lines begin with.
    name: String,
    steps: u64,
    /// What was warned of.
    warned: Vec<&'static str>,
}

impl Progress {
    /// `before`: frames that earlier processes predicted of the schedule's. A training with a name
    /// is not the only one.
    pub fn new(name: String, task: &dyn Task<f32>, before: u64) -> Self {
        Self {
            meter: Meter::new(task.frame_steps(), before, name.is_empty()),
            name,
            steps: task.steps(),
            warned: Vec::new(),
        }
    }

    /// Shows a step that is done, and warns once of what has left its bounds.
    pub fn step(&mut self, report: &StepReport) {
        for alarm in report.alarms() {
            if !self.warned.contains(&alarm.name) {
                self.warned.push(alarm.name);
                notice(format_args!(
                    "warning: {}step {}: {} is {:.1}, below {}: {}",
                    self.name, report.step, alarm.name, alarm.least, alarm.bound, alarm.advice
                ));
            }
        }
        let (rate, left) = self.meter.speed(report.frame_steps);
        let length = report
            .column("length")
            .map(|length| format!("  N {length}"));
        let length = length.unwrap_or_default();
        let what = format!(
            "{}step {}/{}{length}  loss {:.4}  {rate:.0} frames/s  {left} left",
            self.name, report.step, self.steps, report.total
        );
        self.meter.show(report.frame_steps, &what);
    }
}

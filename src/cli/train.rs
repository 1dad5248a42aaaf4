//! `keydance train`: reads a config and a data folder, writes a run's folder.

use std::io::{IsTerminal as _, Write as _};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use clap::Args;
use indicatif::{HumanDuration, ProgressBar, ProgressStyle};

use crate::data::Dataset;
use crate::training::{ExperimentConfig, Outcome, RunFolder, Schedule, StepReport, Trainer};

/// Exit code after Ctrl-C or SIGTERM, as shells have it.
const INTERRUPTED: u8 = 130;
/// Time between two lines where there is no terminal for a progress bar.
const LINE_EVERY: Duration = Duration::from_secs(10);

#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Config of the experiment, TOML
    config: PathBuf,
    /// Folder of BVH files
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Folder for the run: config, manifest, log, checkpoints, weights
    #[arg(long, value_name = "RUN_DIR")]
    out: PathBuf,
    /// Override a key of the config, such as schedule.fraction=0.005; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on from the newest checkpoint in RUN_DIR; the end is the same to the bit as without the break
    #[arg(long)]
    resume: bool,
    /// Threads to compute on [default: all cores]; the weights do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

/// # Errors
/// The config, the data or the run's folder cannot be used; the training diverged.
pub fn run(args: TrainArgs) -> anyhow::Result<ExitCode> {
    let config = ExperimentConfig::load(&args.config, &args.set)?;
    let mut out = std::io::stdout();
    writeln!(out, "{}", config.to_toml()?)?;
    let dataset = Dataset::load(&args.data, &config.data)?;
    let threads = match args.threads {
        Some(threads) => usize::from(threads),
        None => std::thread::available_parallelism().map_or(1, usize::from),
    };
    let mut trainer = Trainer::new(config.clone(), &dataset, threads)?;
    describe(&trainer, threads)?;
    let run = if args.resume {
        let run = RunFolder::resume(&args.out, &config)?;
        let resumed = trainer.resume(&run)?;
        for problem in &resumed.damaged {
            eprintln!("warning: a newer checkpoint is left out: {problem}");
        }
        writeln!(out, "goes on after step {}", resumed.steps)?;
        run
    } else {
        RunFolder::create(&args.out, &config)?
    };
    let stop = stop_on_signal()?;
    let mut progress = Progress::new(trainer.schedule(), trainer.frame_steps_done());
    let outcome = trainer.run(Some(&run), &mut |report| {
        progress.step(report);
        if stop.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    progress.end();
    match outcome? {
        Outcome::Finished => {
            writeln!(out, "{}", run.weights().display())?;
            writeln!(out, "weights {}", trainer.weights_digest())?;
            Ok(ExitCode::SUCCESS)
        }
        Outcome::Stopped => {
            let (done, all) = (trainer.steps_done(), trainer.schedule().steps());
            eprintln!("stopped and saved after step {done} of {all}; go on with");
            eprintln!("  {}", resume_command(&args));
            Ok(ExitCode::from(INTERRUPTED))
        }
    }
}

fn describe(trainer: &Trainer<'_>, threads: usize) -> anyhow::Result<()> {
    let schedule = trainer.schedule();
    writeln!(
        std::io::stdout(),
        "{} parameters; {} epochs, {} steps, {} frame-steps; {threads} threads",
        trainer.parameters().weights(),
        schedule.epochs(),
        schedule.steps(),
        schedule.frame_steps(),
    )?;
    let skipped = schedule.skipped_lengths();
    if let (Some(first), Some(last)) = (skipped.first(), skipped.last()) {
        eprintln!(
            "warning: no training clip is long enough for transitions of {first} to {last} frames: skipped"
        );
    }
    Ok(())
}

/// A flag that Ctrl-C or SIGTERM sets; the second time ends the process at once, which loses the steps since the last
/// checkpoint only.
fn stop_on_signal() -> anyhow::Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            std::process::exit(INTERRUPTED.into());
        }
        eprintln!("stopping after this step; once more to stop at once");
    })
    .context("no handler for Ctrl-C")?;
    Ok(stop)
}

/// The command that goes on where `args` stopped.
fn resume_command(args: &TrainArgs) -> String {
    let path = |path: &Path| quote(&path.to_string_lossy());
    let mut command = format!(
        "keydance train {} --data {} --out {}",
        path(&args.config),
        path(&args.data),
        path(&args.out)
    );
    for set in &args.set {
        command += &format!(" --set {}", quote(set));
    }
    if let Some(threads) = args.threads {
        command += &format!(" --threads {threads}");
    }
    command + " --resume"
}

/// A word for the shell.
fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/=:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// A bar on a terminal, a line now and then elsewhere.
struct Progress {
    bar: Option<ProgressBar>,
    steps: u64,
    frame_steps: u64,
    begun: Instant,
    /// Frames predicted before this process.
    before: u64,
    line: Option<Instant>,
}

impl Progress {
    fn new(schedule: &Schedule, before: u64) -> Self {
        let bar = std::io::stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(
                "{wide_bar} {percent:>3} %  {msg}  {per_sec}  {eta} left",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            let frames_per_second =
                |state: &indicatif::ProgressState, w: &mut dyn std::fmt::Write| {
                    // A terminal that takes no text shows none.
                    let _ = write!(w, "{:.0} frames/s", state.per_sec());
                };
            let bar = ProgressBar::new(schedule.frame_steps())
                .with_style(style.with_key("per_sec", frames_per_second));
            bar.set_position(before);
            bar.reset_eta();
            bar
        });
        Self {
            bar,
            steps: schedule.steps(),
            frame_steps: schedule.frame_steps(),
            begun: Instant::now(),
            before,
            line: None,
        }
    }

    fn step(&mut self, report: &StepReport) {
        let what = format!(
            "step {}/{}  N {}  loss {:.4}",
            report.step, self.steps, report.length, report.total
        );
        if let Some(bar) = &self.bar {
            bar.set_message(what);
            bar.set_position(report.frame_steps);
            return;
        }
        if self.line.is_none_or(|last| last.elapsed() >= LINE_EVERY) || report.step == self.steps {
            self.line = Some(Instant::now());
            let done = (report.frame_steps - self.before) as f64;
            let rate = done / self.begun.elapsed().as_secs_f64().max(1e-9);
            let left = (self.frame_steps - report.frame_steps) as f64 / rate.max(1e-9);
            eprintln!(
                "{what}  {rate:.0} frames/s  {} left",
                HumanDuration(Duration::from_secs(left as u64))
            );
        }
    }

    fn end(&self) {
        if let Some(bar) = &self.bar {
            bar.abandon();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_to_resume_quotes_what_a_shell_would_change() {
        let args = TrainArgs {
            config: "a b.toml".into(),
            data: "data".into(),
            out: "runs/1".into(),
            set: vec!["name=x".into(), "data.split={ share = 0.5 }".into()],
            resume: false,
            threads: Some(2),
        };
        assert_eq!(
            resume_command(&args),
            "keydance train 'a b.toml' --data data --out runs/1 --set name=x \
             --set 'data.split={ share = 0.5 }' --threads 2 --resume"
        );
    }
}

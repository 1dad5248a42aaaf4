//! Stopping a command that takes long, and going on with it.

use std::fmt::Display;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use anyhow::Context as _;

use super::notice::notice;
use crate::ranks;

/// Exit code after Ctrl-C or SIGTERM, as shells have it.
const INTERRUPTED: u8 = 130;
/// How long an evaluation may take to end by itself.
const LATE: Duration = Duration::from_secs(1);
/// Time between two looks at whether a stop was asked for.
pub const LOOK_EVERY: Duration = Duration::from_millis(100);

/// Whether the user asked to stop.
pub struct Stop {
    asked: Arc<OnceLock<Instant>>,
    /// Held by every training, which is to be saved first.
    trainings: Arc<()>,
    /// What is said at the end.
    pub farewell: String,
}

/// While it lives, nothing is lost by an end at once; see [`Stop::at_once`].
pub struct AtOnce(Arc<AtomicBool>);

impl Drop for AtOnce {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl Stop {
    /// Asked by Ctrl-C or SIGTERM; the second time ends the process at once, which loses the steps
    /// since the last checkpoint only.
    ///
    /// # Errors
    /// The signals cannot be caught. A process does so once.
    pub fn on_signal(farewell: String) -> anyhow::Result<Self> {
        let asked = Arc::new(OnceLock::new());
        let flag = Arc::clone(&asked);
        ctrlc::set_handler(move || {
            if flag.set(Instant::now()).is_err() {
                std::process::exit(INTERRUPTED.into());
            }
            notice("stopping; once more to stop at once");
        })
        .context("no handler for Ctrl-C")?;
        Ok(Self {
            asked,
            trainings: Arc::default(),
            farewell,
        })
    }

    pub fn is_asked(&self) -> bool {
        self.asked.get().is_some()
    }

    /// Ends the process with this farewell where it is asked to stop before the result is dropped.
    pub fn at_once(&self, farewell: String) -> AtOnce {
        let ended = Arc::new(AtomicBool::new(false));
        let (asked, over) = (Arc::clone(&self.asked), Arc::clone(&ended));
        std::thread::spawn(move || {
            while !over.load(Ordering::Relaxed) {
                if asked.get().is_some() {
                    notice(&farewell);
                    std::process::exit(INTERRUPTED.into());
                }
                std::thread::sleep(LOOK_EVERY);
            }
        });
        AtOnce(ended)
    }

    /// Says that a training goes on while the result lives.
    pub fn training(&self) -> Arc<()> {
        Arc::clone(&self.trainings)
    }

    /// Ends the process where what else goes on took too long to end by itself, and no training is
    /// to be saved.
    pub fn end_late(&self, before: impl FnOnce()) {
        let late = self.asked.get().is_some_and(|it| it.elapsed() > LATE);
        if late && Arc::strong_count(&self.trainings) == 1 {
            before();
            notice(&self.farewell);
            std::process::exit(INTERRUPTED.into());
        }
    }
}

/// Says how a command that was stopped goes on; its exit code.
pub fn interrupted(farewell: impl Display) -> ExitCode {
    notice(farewell);
    ExitCode::from(INTERRUPTED)
}

/// The command as it was given, for a shell.
pub fn command() -> String {
    let words = std::env::args_os().skip(1);
    let words = words.map(|word| format!(" {}", quote(&word.to_string_lossy())));
    let launcher = match ranks::launched() {
        Some((_, count)) if count > 1 => format!("mpirun -n {count} "),
        _ => String::new(),
    };
    format!("{launcher}keydance{}", words.collect::<String>())
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

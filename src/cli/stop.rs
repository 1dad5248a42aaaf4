//! Stopping a command that takes long, and going on with it.

use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context as _;

use super::notice::notice;

/// Exit code after Ctrl-C or SIGTERM, as shells have it.
const INTERRUPTED: u8 = 130;

/// Whether the user asked to stop.
#[derive(Clone)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Set by Ctrl-C or SIGTERM; the second time ends the process at once, which loses the steps
    /// since the last checkpoint only.
    ///
    /// # Errors
    /// The signals cannot be caught. A process does so once.
    pub fn on_signal() -> anyhow::Result<Self> {
        let stop = Self(Arc::new(AtomicBool::new(false)));
        let flag = stop.clone();
        ctrlc::set_handler(move || {
            if flag.0.swap(true, Ordering::Relaxed) {
                std::process::exit(INTERRUPTED.into());
            }
            notice("stopping; once more to stop at once");
        })
        .context("no handler for Ctrl-C")?;
        Ok(stop)
    }

    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The exit code of a command that was stopped.
pub fn interrupted() -> ExitCode {
    ExitCode::from(INTERRUPTED)
}

/// The command as it was given, for the shell.
pub fn command_line() -> String {
    let words = std::env::args_os().skip(1);
    let words = words.map(|word| format!(" {}", quote(&word.to_string_lossy())));
    format!("keydance{}", words.collect::<String>())
}

fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-/=:,+@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

//! What a command says on stderr.

use std::fmt::Display;
use std::io::{self, Write};

use crate::ranks;

/// Whether this process says nothing: of several that train together the first speaks for all.
pub fn is_mute() -> bool {
    ranks::launched().is_some_and(|(rank, _)| rank > 0)
}

/// Standard output, where this process says something.
pub fn out() -> Box<dyn Write> {
    match is_mute() {
        true => Box::new(io::sink()),
        false => Box::new(io::stdout()),
    }
}

/// Writes a line to stderr. Where nobody reads it any more, the command goes on: a training is
/// worth more than its progress lines.
pub fn notice(line: impl Display) {
    if !is_mute() {
        of_any_rank(line);
    }
}

/// The same from whichever process.
pub fn of_any_rank(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Warnings that the library gives beside what it read, a line each on stderr.
pub fn warn(warnings: impl IntoIterator<Item: Display>) {
    for warning in warnings {
        notice(format_args!("warning: {warning}"));
    }
}

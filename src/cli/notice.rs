//! What a command says on stderr.

use std::fmt::Display;
use std::io::{self, Write as _};

/// Writes a line to stderr. Where nobody reads it any more, the command goes on: a training is
/// worth more than its progress lines.
pub fn notice(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

/// Warnings that the library gives beside what it read, a line each on stderr.
pub fn warn(warnings: impl IntoIterator<Item: Display>) {
    for warning in warnings {
        notice(format_args!("warning: {warning}"));
    }
}

use std::process::ExitCode;

use clap::Parser as _;
use keydance::cli::{self, Cli};

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(code) => code,
        Err(error) => cli::report(&error),
    }
}

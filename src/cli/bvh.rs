//! `keydance bvh`: reads a BVH file, prints what is in it.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::{Args, Subcommand};

use crate::motion::bvh::{self, Inspection};

#[derive(Debug, Args)]
pub struct BvhArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print hierarchy, frames, rate, duration, channels and the range of root heights
    Inspect {
        /// BVH file
        file: PathBuf,
    },
}

/// # Errors
/// The file cannot be read as BVH, or the output cannot be written.
pub fn run(args: BvhArgs) -> anyhow::Result<()> {
    let Action::Inspect { file } = args.action;
    write!(io::stdout().lock(), "{}", Inspection(&bvh::read(&file)?))?;
    Ok(())
}

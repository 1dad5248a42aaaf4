//! `keydance runs`: reads a folder of runs, writes what became of each.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::report::RunTable;

/// List the runs in a folder: state, progress, speed, scores
///
/// Look into the folders inside it, too. A run is "running" while a training writes to it,
/// "stopped" after Ctrl-C and "interrupted" after a kill or an error: both go on with `keydance
/// train --resume`. Once evaluated: LRP in cm, at transitions of 10 to 150 frames, or the first
/// metric of the model's own protocol.
#[derive(Debug, Args)]
pub struct RunsArgs {
    /// Folder of runs, or a run's folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// # Errors
/// The folder cannot be read, or holds no run. A damaged run is listed as such and is no error.
pub fn run(args: RunsArgs) -> anyhow::Result<()> {
    write!(std::io::stdout(), "{}", RunTable::of(&args.folder)?)?;
    Ok(())
}

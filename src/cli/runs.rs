//! `keydance runs`: reads a folder of runs, writes what became of each.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use crate::report::RunTable;
use crate::run::RunFolder;

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
    let table = RunTable::of(&args.folder)
        .with_context(|| format!("the folder {} cannot be read", args.folder.display()))?;
    if table.is_empty() {
        anyhow::bail!(
            "{} holds no run: no folder in it has a {}; `keydance train` makes one",
            args.folder.display(),
            RunFolder::CONFIG
        );
    }
    write!(std::io::stdout(), "{table}")?;
    Ok(())
}

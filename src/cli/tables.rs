//! `keydance tables`: reads runs' folders that `keydance evaluate` has been through, writes a
//! Markdown file.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::experiment::EvaluatedRun;
use crate::run::{RunFolder, check_outputs, replace_file};

#[derive(Debug, Args)]
pub struct TablesArgs {
    /// Folders of evaluated runs, and folders that `keydance evaluate CONFIG --out DIR` made
    #[arg(value_name = "RUN_DIR", required = true)]
    runs: Vec<PathBuf>,
    /// Where to write the tables, Markdown
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Replace the tables where they are there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A folder has no scores, or the scores are of different data; nothing is written then. The file
/// cannot be written.
pub fn run(args: TablesArgs) -> anyhow::Result<()> {
    let parts = |run: &PathBuf| RunFolder::open(run).parts();
    let inputs: Vec<PathBuf> = args.runs.iter().flat_map(parts).collect();
    check_outputs([&args.out], &inputs, args.force)?;
    replace_file(&args.out, EvaluatedRun::tables(&args.runs)?)?;
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(())
}

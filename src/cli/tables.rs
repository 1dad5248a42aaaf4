//! `keydance tables`: reads runs' folders that `keydance evaluate` has been through, writes a
//! Markdown file.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::evaluation::{TableRow, markdown_tables};
use crate::experiment::EvaluatedRun;
use crate::run::replace_file;

#[derive(Debug, Args)]
pub struct TablesArgs {
    /// Folders of evaluated runs, and folders that `keydance evaluate CONFIG --out DIR` made
    #[arg(value_name = "RUN_DIR", required = true)]
    runs: Vec<PathBuf>,
    /// Where to write the tables, Markdown
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// # Errors
/// A folder has no scores, or the scores are of different data; nothing is written then. The file
/// cannot be written.
pub fn run(args: TablesArgs) -> anyhow::Result<()> {
    let runs = EvaluatedRun::read_all(&args.runs)?;
    let rows: Vec<TableRow> = runs.iter().map(EvaluatedRun::row).collect();
    let measured_on = runs
        .first()
        .map_or_else(String::new, |run| run.record.data.caption());
    replace_file(&args.out, markdown_tables(&rows, &measured_on).as_bytes())?;
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(())
}

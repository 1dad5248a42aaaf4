//! `keydance pack`: a run to pass on.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::run::RunFolder;

/// Write a run to pass on: config, manifest, and weights of half the size
///
/// The folder is used like a run's: by generate, evaluate and figures. Weights are in f16, rounded
/// from f32, so its scores differ in late digits. A training cannot go on from it.
#[derive(Debug, Args)]
pub struct PackArgs {
    /// Folder of a run
    #[arg(value_name = "RUN_DIR")]
    run: PathBuf,
    /// Folder to write
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Write into a folder that holds other files
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The run has no weights, or the folder cannot be written.
pub fn run(args: PackArgs) -> anyhow::Result<()> {
    RunFolder::open(&args.run).pack(&args.out, args.force)?;
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(())
}

//! `keydance completions` and `keydance man`: what a shell and `man` need to know.

use std::io::{self, Write as _};
use std::path::PathBuf;

use anyhow::Context as _;
use clap::{Args, CommandFactory as _};
use clap_complete::Shell;

use super::Cli;

/// Print the completions of a shell, for its startup file
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    shell: Shell,
}

/// Write man pages: keydance.1 and one for each command
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for the pages, made if it is not there
    folder: PathBuf,
    /// Replace pages that are there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The output cannot be written.
pub fn completions(args: &CompletionsArgs) -> anyhow::Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "keydance", &mut text);
    io::stdout().write_all(&text)?;
    Ok(())
}

/// # Errors
/// A page cannot be written.
pub fn man(args: &ManArgs) -> anyhow::Result<()> {
    let folder = &args.folder;
    let failed = || format!("the pages cannot be written to {}", folder.display());
    let page = folder.join("keydance.1");
    if page.exists() && !args.force {
        anyhow::bail!("{} is there already; --force replaces it", page.display());
    }
    std::fs::create_dir_all(folder).with_context(failed)?;
    clap_mangen::generate_to(Cli::command(), folder).with_context(failed)?;
    writeln!(io::stdout(), "{}", folder.display())?;
    Ok(())
}

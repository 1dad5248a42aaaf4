//! `keydance rig`: what of a rig is recognised, and a mapping file of it.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::Args;

use crate::motion::{Recognised, bvh};
use crate::run::{check_outputs, replace_file};

/// Print which joints of a rig stand for the dance skeleton's 24, and write a mapping file of it
///
/// `generate` recognises rigs in the same way by itself. The mapping file is for a rig that is not
/// recognised, or not rightly: edit it and give it by --mapping.
#[derive(Debug, Args)]
pub struct RigArgs {
    /// BVH file on the rig
    file: PathBuf,
    /// Where to write the mapping; joints that were not found stand there to be filled in
    #[arg(long, value_name = "FILE.toml")]
    out: Option<PathBuf>,
    /// Replace the mapping where it is there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The file cannot be read as BVH, or the mapping cannot be written.
pub fn run(args: RigArgs) -> anyhow::Result<()> {
    check_outputs(&args.out, [&args.file], args.force)?;
    let document = bvh::read(&args.file)?;
    let found = Recognised::of(document.skeleton());
    if let Some(path) = &args.out {
        replace_file(path, found.mapping_file(document.name()))?;
    }
    write!(io::stdout().lock(), "{found}")?;
    if let Some(path) = &args.out {
        writeln!(io::stdout(), "{}", path.display())?;
    }
    Ok(())
}

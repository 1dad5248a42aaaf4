//! `keydance prepare`: a data folder in one file.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::notice::{out, warn};
use super::progress::Meter;
use crate::counted::counted;
use crate::data::prepare;
use crate::experiment::ExperimentConfig;
use crate::run::check_outputs;

/// Put the motions of a data folder into one file, to train on more than memory holds
///
/// The file is given to --data in place of the folder, by every command. Models of transitions
/// (pan2021, harvey2020) then train on windows that are read as they are needed; other models and
/// commands read all of it into memory. Poses are those of the folder to the bit, and so are
/// weights. It holds motions alone: no music, no lists of a data set's own.
#[derive(Debug, Args)]
pub struct PrepareArgs {
    /// Folder of BVH files
    #[arg(value_name = "DIR")]
    data: PathBuf,
    /// File to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Config whose [data] says how the files are read; without one, the defaults
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Override a key of the config, such as data.fps=60; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Replace the file if it is there
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The folder cannot be read as the config says, or the file cannot be written.
pub fn run(args: PrepareArgs) -> anyhow::Result<()> {
    let config = match &args.config {
        Some(path) => ExperimentConfig::load(path, &args.set)?,
        None => ExperimentConfig::with_sets(&args.set)?,
    };
    check_outputs([&args.out], [&args.data], args.force)?;
    let mut meter = None;
    let prepared = prepare(&args.data, &config.data, &args.out, &mut |done, all| {
        let (done, all) = (done as u64, all as u64);
        let meter = meter.get_or_insert_with(|| Meter::new(all, 0, true));
        meter.show(done, &format!("{done} of {}", counted(all, "clip")));
    });
    meter.iter_mut().for_each(Meter::clear);
    let prepared = prepared?;
    warn(&prepared.warnings);
    writeln!(
        out(),
        "{}: {}, {}, {:.1} MB",
        args.out.display(),
        counted(prepared.clips, "clip"),
        counted(prepared.frames, "frame"),
        prepared.bytes as f64 / 1e6,
    )?;
    Ok(())
}

//! `keydance prepare`: a data folder in one file.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::bail;
use clap::Args;

use super::notice::{out, warn};
use super::progress::Meter;
use super::stop::{Stop, command, interrupted};
use crate::counted::counted;
use crate::data::{is_prepared, prepare};
use crate::experiment::ExperimentConfig;
use crate::run::check_outputs;

/// Put the motions of a data folder into one file, to train on more than memory holds
///
/// The file is given to --data in place of the folder. Models of transitions and rotations (Pan et
/// al., Harvey et al., Li et al., Duan et al.) then train on windows that are read as they are
/// needed; commands that score read all of it into memory. Poses are those of the folder to the
/// bit, and so are weights. It holds motions alone: models of music take the folder.
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
    /// Replace the file if it is there and a prepared set
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The folder cannot be read as the config says, or the file cannot be written.
pub fn run(args: PrepareArgs) -> anyhow::Result<ExitCode> {
    let config = match &args.config {
        Some(path) => ExperimentConfig::load(path, &args.set)?,
        None => ExperimentConfig::with_sets(&args.set)?,
    };
    check_outputs(
        [&args.out],
        [&args.data].into_iter().chain(&args.config),
        args.force,
    )?;
    if args.out.exists() && !is_prepared(&args.out) {
        bail!(
            "{} is there and no prepared set, which alone is replaced; give another file",
            args.out.display()
        );
    }
    let stop = Stop::on_signal(String::new())?;
    let mut meter = None;
    let prepared = prepare(&args.data, &config.data, &args.out, &mut |done, all| {
        let (done, all) = (done as u64, all as u64);
        let meter = meter.get_or_insert_with(|| Meter::new(all, 0, true));
        meter.show(done, &format!("{done} of {}", counted(all, "clip")));
        match stop.is_asked() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    });
    meter.iter_mut().for_each(Meter::clear);
    let Some(prepared) = prepared? else {
        return Ok(interrupted(format_args!(
            "stopped, nothing is written; begin again with\n  {}",
            command()
        )));
    };
    warn(&prepared.warnings);
    writeln!(
        out(),
        "{}: {}, {}, {:.1} MB",
        args.out.display(),
        counted(prepared.clips, "clip"),
        counted(prepared.frames, "frame"),
        prepared.bytes as f64 / 1e6,
    )?;
    Ok(ExitCode::SUCCESS)
}

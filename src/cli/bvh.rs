//! `keydance bvh`: reads a BVH file, prints what is in it.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::file_units::FileUnits;
use super::notice::warn;
use crate::motion::bvh::{self, Inspection};
use crate::motion::oddities::oddities;

#[derive(Debug, Args)]
pub struct BvhArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Print hierarchy, frames, rate, duration, channels, unit, upward axis and the range of root
    /// heights
    Inspect {
        /// BVH file
        file: PathBuf,
        #[command(flatten)]
        units: FileUnits,
    },
}

/// # Errors
/// The file cannot be read as BVH, or the output cannot be written.
pub fn run(args: BvhArgs) -> anyhow::Result<()> {
    let Action::Inspect { file, units } = args.action;
    let document = bvh::read(&file)?;
    let named = |oddity| format!("{}: {oddity}", document.name());
    warn(oddities(&document.to_clip()).into_iter().map(named));
    let inspection = Inspection {
        document: &document,
        unit: units.unit.unwrap_or_default(),
        up: units.up.unwrap_or_default(),
    };
    write!(io::stdout().lock(), "{inspection}")?;
    Ok(())
}

//! `keydance view`: clips on a page, to look at.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::file_units::FileUnits;
use super::notice::warn;
use crate::data::DataConfig;
use crate::motion::Mapping;
use crate::report::viewer::clips_page;
use crate::run::{check_outputs, replace_file};

/// Write a page that plays clips in 3D, to choose keyframes by looking
///
/// The page opens from disk and needs no network. "Pick" (m) takes the frame shown as a keyframe
/// and hands over all that were picked as generate takes them; a link leads to a frame; "Film"
/// saves the scene as WebM. Several clips stand side by side or over each other, at the first one's
/// rate. BVH files that are dropped on any such page, or opened from it, are shown in place of its
/// own, each skeleton as it is.
#[derive(Debug, Args)]
pub struct ViewArgs {
    /// BVH files
    #[arg(value_name = "FILE.bvh", required = true)]
    files: Vec<PathBuf>,
    /// The page
    #[arg(long, value_name = "OUT.html")]
    out: PathBuf,
    /// Mapping file for a rig that is not recognised
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    #[command(flatten)]
    units: FileUnits,
    /// Replace the page where it is there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A file cannot be read; clips that cannot be shown together; the page cannot be written.
pub fn run(args: ViewArgs) -> anyhow::Result<()> {
    check_outputs(
        [&args.out],
        args.files.iter().chain(&args.mapping),
        args.force,
    )?;
    let data = DataConfig {
        mapping: args.mapping.as_deref().map(Mapping::read).transpose()?,
        ..args.units.over(&DataConfig::default())
    };
    let (page, notices) = clips_page(&args.files, &data)?;
    warn(notices);
    replace_file(&args.out, page)?;
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(())
}

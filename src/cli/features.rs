//! `keydance features`: reads a BVH file, writes a .npy file.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;
use ndarray_npy::WriteNpyExt as _;

use super::file_units::FileUnits;
use super::notice::warn;
use crate::data::DataConfig;
use crate::models::transition::DanceClip;
use crate::motion::{Mapping, bvh};
use crate::run::{check_outputs, replace_file};

#[derive(Debug, Args)]
pub struct FeaturesArgs {
    /// BVH file; brought to 30 frames a second
    file: PathBuf,
    /// Where to write the array: float32, [frames, 154], not standardised
    #[arg(long, value_name = "FILE")]
    npy: PathBuf,
    /// Mapping file for a skeleton other than the dance skeleton [default: the joints are
    /// recognised]
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
    #[command(flatten)]
    units: FileUnits,
    /// Replace the array where it is there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A file cannot be read, or the clip does not go onto the dance skeleton; nothing is written then.
/// The array cannot be written.
pub fn run(args: FeaturesArgs) -> anyhow::Result<()> {
    let inputs = [&args.file].into_iter().chain(&args.mapping);
    check_outputs([&args.npy], inputs, args.force)?;
    let mapping = args.mapping.as_deref().map(Mapping::read).transpose()?;
    let clip = bvh::read(&args.file)?.to_clip();
    let data = args.units.over(&DataConfig::default());
    let mapping = Mapping::onto_dance_skeleton(&clip, mapping.as_ref())?;
    let (measured, notices) = DanceClip::from_file(clip, mapping.as_deref(), &data)?;
    warn(&notices);
    let array = measured.features.mapv(|value| value as f32);
    let mut file = Vec::new();
    array.write_npy(&mut file)?;
    replace_file(&args.npy, file)?;
    let (frames, numbers) = array.dim();
    writeln!(
        std::io::stdout(),
        "{}: float32 [{frames}, {numbers}]",
        args.npy.display()
    )?;
    Ok(())
}

//! `keydance choreography`: writes generated dance clips as BVH files, for whoever has no motion
//! capture.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use super::list::within;
use crate::data::choreography::{CLIPS, ChoreographyConfig, FRAMES, write_clips};
use crate::run::check_output_folder;

#[derive(Debug, Args)]
pub struct ChoreographyArgs {
    /// Folder for the clips, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of clips; styles take turns
    #[arg(long, default_value_t = ChoreographyConfig::default().clips, value_parser = within(CLIPS))]
    clips: usize,
    /// Frames of each clip, at 30 a second
    #[arg(long, default_value_t = ChoreographyConfig::default().frames_per_clip,
        value_parser = within(FRAMES))]
    frames: usize,
    /// Number that the dances follow from
    #[arg(long, default_value_t = ChoreographyConfig::default().seed)]
    seed: u64,
    /// Write music on the dances' beats, too: a wav file of each clip's name
    #[arg(long)]
    music: bool,
    /// Write into a folder that holds files, and replace those of the same names
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A file cannot be written.
pub fn run(args: ChoreographyArgs) -> anyhow::Result<()> {
    let config = ChoreographyConfig {
        clips: args.clips,
        frames_per_clip: args.frames,
        seed: args.seed,
    };
    check_output_folder(&args.out, args.force)?;
    let mut out = std::io::stdout();
    for file in write_clips(&config, args.music, &args.out)? {
        writeln!(out, "{}", file?.display())?;
    }
    Ok(())
}

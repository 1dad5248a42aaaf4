//! `keydance choreography`: writes generated dance clips as BVH files, for whoever has no motion
//! capture.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use crate::data::choreography::{ChoreographyConfig, clips};
use crate::motion::bvh::{self, Axis, Bvh, channel_layout};
use crate::run::check_output_folder;

#[derive(Debug, Args)]
pub struct ChoreographyArgs {
    /// Folder for the clips, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of clips; styles take turns
    #[arg(long, default_value_t = ChoreographyConfig::default().clips)]
    clips: usize,
    /// Frames of each clip, at 30 a second
    #[arg(long, default_value_t = ChoreographyConfig::default().frames_per_clip)]
    frames: usize,
    /// Number that the dances follow from
    #[arg(long, default_value_t = ChoreographyConfig::default().seed)]
    seed: u64,
    /// Write into a folder that holds files, and replace those of the same names
    #[arg(long)]
    force: bool,
}

/// # Errors
/// No clips or frames or too many are asked for, or a file cannot be written.
pub fn run(args: ChoreographyArgs) -> anyhow::Result<()> {
    let config = ChoreographyConfig {
        clips: args.clips,
        frames_per_clip: args.frames,
        seed: args.seed,
    };
    let clips = clips(&config)?;
    check_output_folder(&args.out, args.force)?;
    std::fs::create_dir_all(&args.out)
        .with_context(|| format!("{} cannot be created", args.out.display()))?;
    let mut out = std::io::stdout();
    for generated in clips {
        let channels = channel_layout(&generated.clip, [Axis::Z, Axis::X, Axis::Y]);
        let path = args.out.join(&generated.clip.name);
        bvh::write(&path, &Bvh::from_clip(&generated.clip, channels)?)?;
        writeln!(out, "{}", path.display())?;
    }
    Ok(())
}

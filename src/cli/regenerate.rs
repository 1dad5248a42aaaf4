//! `keydance regenerate`: new dances to the music of a recorded one.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::notice::warn;
use crate::run::{Subject, check_output_folder};
use crate::synthesis::regenerate::Regeneration;

/// Make new dances to the music of a recorded one, from random key poses of it
///
/// Each goes on from the beginning of the recorded dance and meets poses of it that are drawn as in
/// training. They are written as NAME_001.bvh and so on.
#[derive(Debug, Args)]
pub struct RegenerateArgs {
    /// Folder of a run of a model that dances to music
    #[arg(value_name = "RUN_DIR")]
    run: PathBuf,
    /// BVH file of the recorded dance
    #[arg(value_name = "CLIP")]
    clip: PathBuf,
    /// Its music [default: the sound file of its name beside it, or in the folder audio beside its
    /// own]
    #[arg(long, value_name = "SONG")]
    music: Option<PathBuf>,
    /// How many dances
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    count: u64,
    /// What is drawn follows from this
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the dances, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Write into a folder that holds files, and replace those of the same names
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A run, clip or song that cannot be used; a model that does not dance to music; a file cannot be
/// written.
pub fn run(args: RegenerateArgs) -> anyhow::Result<()> {
    let subject = Subject::open(&args.run, &[])?;
    let dances = Regeneration::new(&subject, &args.clip, args.music, &args.out, args.seed)?;
    check_output_folder(&args.out, args.force)?;
    let stem = args.clip.file_stem().unwrap_or_default().to_string_lossy();
    let mut out = std::io::stdout();
    for number in 1..=args.count {
        let song = dances.song(number)?;
        if number == 1 {
            warn(&song.notices);
            std::fs::create_dir_all(&args.out)
                .with_context(|| format!("{} cannot be created", args.out.display()))?;
        }
        let path = args.out.join(format!("{stem}_{number:03}.bvh"));
        let summary = song.write(&*subject.model, &path)?;
        writeln!(out, "{}  {}", path.display(), summary.about_key_poses())?;
        let name = path.display();
        warn(summary.whirl().map(|whirl| format!("{name}: {whirl}")));
    }
    Ok(())
}

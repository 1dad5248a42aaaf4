//! `keydance generate --music`: a dance to a song, from a seed and key poses.

use std::io::Write as _;
use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::GenerateArgs;
use crate::cli::notice::warn;
use crate::motion::bvh;
use crate::music::Cache;
use crate::run::{Subject, write_json};
use crate::synthesis::keyframes::{FileFrom, Time};
use crate::synthesis::song::{Seed, Song, SongChoice};

#[derive(Debug, Args)]
pub struct SongArgs {
    /// Sound file (wav, flac, mp3, ogg) that the dance goes to, as long as it is; key poses are
    /// given by --keyframe, their TIME in the song, such as jump.bvh:75@12.5s
    #[arg(long, value_name = "SONG")]
    pub music: Option<PathBuf>,
    /// BVH file whose motion the dance goes on from: its last frames, or those from FRAME on
    #[arg(long, value_name = "FILE.bvh[:FRAME]", requires = "music")]
    seed_motion: Option<FileFrom>,
    /// A pose that is held before the dance goes on from it
    #[arg(
        long,
        value_name = "FILE.bvh[:FRAME]",
        requires = "music",
        conflicts_with = "seed_motion"
    )]
    seed_pose: Option<FileFrom>,
    /// End of the dance, where it is shorter than the song: frames, or seconds such as 30s
    #[arg(long, value_name = "TIME", requires = "music")]
    until: Option<Time>,
}

impl SongArgs {
    /// The files that they name.
    pub fn files(&self) -> Vec<&PathBuf> {
        let seeds = self.seed_motion.iter().chain(&self.seed_pose);
        let seeds = seeds.map(|seed| &seed.file);
        self.music.iter().chain(seeds).collect()
    }
}

/// # Errors
/// As [`super::run`].
pub fn run(args: &GenerateArgs, subject: &Subject, music: &PathBuf) -> anyhow::Result<()> {
    let data = args.units.over(&subject.config.data);
    let choice = args.keyframes.choice(data.fps);
    if choice.motion.is_some() {
        anyhow::bail!("--motion gives no key poses to a song; name each with --keyframe");
    }
    if args.viewer.is_some() || args.foot_cleanup {
        anyhow::bail!("--viewer and --foot-cleanup do not go with --music yet; leave them out");
    }
    let song = &args.song;
    let seed = match (&song.seed_motion, &song.seed_pose) {
        (Some(from), _) => Seed::Motion(from.file.clone(), from.given()),
        (_, Some(from)) => Seed::Pose(from.clone()),
        _ => anyhow::bail!(
            "a dance goes on from something: give --seed-motion FILE.bvh, or --seed-pose \
             FILE.bvh:FRAME"
        ),
    };
    let choice = SongChoice {
        music: music.clone(),
        seed,
        key_poses: choice.further,
        frames: song.until.map(|until| until.frame(data.fps)),
        mapping: choice.mapping,
    };
    let model = subject.model.as_ref();
    let song = Song::read(&choice, model, &data, &Cache::of_user())?;
    warn(&song.notices);
    let name = args.out.file_name().unwrap_or_default().to_string_lossy();
    let (dance, summary) = song.dance(model, &name)?;
    let document = song.document(&dance);
    let document = document.context("the motion cannot be written")?;
    bvh::write(&args.out, &document)?;
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    writeln!(std::io::stdout(), "{summary}{}", args.out.display())?;
    Ok(())
}

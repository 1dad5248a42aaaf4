//! `keydance generate --music`: a dance to a song, from a seed and key poses.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::cli::list::with_file;
use crate::report::viewer::Sound;
use crate::synthesis::keyframes::{FileFrom, Time};
use crate::synthesis::song::{Seed, SongRequest};

#[derive(Debug, Args)]
pub struct SongArgs {
    /// Sound file (wav, flac, mp3, ogg) that the dance goes to, as long as it is; key poses are
    /// given by --keyframe, their TIME in the song, such as jump.bvh:75@12.5s
    #[arg(long, value_name = "SONG")]
    music: Option<PathBuf>,
    /// BVH file whose motion the dance goes on from: its last frames, or those from FRAME on
    #[arg(long, value_name = "FILE.bvh[:FRAME]", requires = "music", value_parser = with_file::<FileFrom>())]
    seed_motion: Option<FileFrom>,
    /// A pose that is held before the dance goes on from it
    #[arg(
        long,
        value_name = "FILE.bvh[:FRAME]",
        value_parser = with_file::<FileFrom>(),
        requires = "music",
        conflicts_with = "seed_motion"
    )]
    seed_pose: Option<FileFrom>,
    /// Put the sound itself into the page of --viewer, which else looks for it where it is now; it
    /// may not be yours to pass on
    #[arg(long, requires = "viewer")]
    embed_music: bool,
    /// So many dances, each drawn anew: --seed is that of the first. Files are numbered, such as
    /// OUT_1.bvh; the page shows all
    #[arg(long, value_name = "N", requires = "music", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub count: u64,
    /// End of the dance, where it is shorter than the song: frames, or seconds such as 30s
    #[arg(
        long,
        value_name = "TIME",
        requires = "music",
        allow_hyphen_values = true
    )]
    until: Option<Time>,
}

impl SongArgs {
    /// Whether there is a song.
    pub fn is_asked(&self) -> bool {
        self.music.is_some()
    }

    /// The song that they ask for, if any, at so many frames a second.
    pub fn request(&self, fps: f64) -> Option<SongRequest> {
        let motion = |from: &FileFrom| Seed::Motion(from.file.clone(), from.given());
        let seed = self.seed_motion.as_ref().map(motion);
        Some(SongRequest {
            music: self.music.clone()?,
            seed: seed.or_else(|| self.seed_pose.clone().map(Seed::Pose)),
            frames: self.until.map(|until| until.frame(fps)),
        })
    }

    /// Where a page has the sound.
    pub fn sound<'p>(&self, page: &'p Path) -> Sound<'p> {
        match self.embed_music {
            true => Sound::Embedded,
            false => Sound::Beside(page),
        }
    }
}

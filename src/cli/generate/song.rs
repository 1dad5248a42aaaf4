//! `keydance generate --music`: a dance to a song, from a seed and key poses.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use clap::Args;
use url::Url;

use super::GenerateArgs;
use crate::cli::notice::warn;
use crate::models::generator::Condition;
use crate::motion::bvh;
use crate::music::Cache;
use crate::report::ViewerMusic;
use crate::report::viewer::song_page;
use crate::run::{Subject, replace_file, write_json};
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
    /// Put the sound itself into the page of --viewer, which else looks for it where it is now; it
    /// may not be yours to pass on
    #[arg(long, requires = "viewer")]
    embed_music: bool,
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
    /// The files that they name.
    pub fn files(&self) -> Vec<&PathBuf> {
        let seeds = self.seed_motion.iter().chain(&self.seed_pose);
        let seeds = seeds.map(|seed| &seed.file);
        self.music.iter().chain(seeds).collect()
    }
}

/// # Errors
/// As [`super::run`].
pub fn run(args: &GenerateArgs, subject: &Subject, music: &Path) -> anyhow::Result<()> {
    let data = args.units.over(&subject.config.data);
    let choice = args.keyframes.choice(data.fps);
    if choice.motion.is_some() {
        anyhow::bail!("--motion gives no key poses to a song; name each with --keyframe");
    }
    if args.foot_cleanup {
        anyhow::bail!(
            "--foot-cleanup: {} says of no foot that it stands",
            subject.what
        );
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
        music: music.into(),
        seed,
        key_poses: choice.further,
        frames: song.until.map(|until| until.frame(data.fps)),
        mapping: choice.mapping,
    };
    let model = subject.model.as_ref();
    let song = Song::read(&choice, model, &data, &Cache::of_user())?;
    let needs = model.needs();
    let contacts = args.contacts.contacts.as_ref();
    let contacts = contacts.map(|_| Condition::Contacts);
    let asked = [args.trajectory.asked(), args.velocity.asked(), contacts];
    let unread = asked.into_iter().flatten().filter(|&it| !needs.reads(it));
    let unread = unread.map(|it| format!("the model does not read {}: left out", it.title()));
    warn(unread.collect::<Vec<String>>());
    warn(&song.notices);
    let name = args.out.file_name().unwrap_or_default().to_string_lossy();
    let (dance, summary) = song.dance(model, &name)?;
    let document = song.document(&dance);
    let document = document.context("the motion cannot be written")?;
    let page = args.viewer.as_ref().map(|page| {
        let music = ViewerMusic {
            name: music
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into(),
            source: match args.song.embed_music {
                true => embedded(music)?,
                false => address(music, page)?,
            },
            beats: within(&song.music.beats, dance.poses.len()),
            downbeats: within(&song.music.downbeats, dance.poses.len()),
        };
        anyhow::Ok(song_page(
            &subject.config.name,
            &song,
            &dance,
            &data,
            music,
        )?)
    });
    let page = page.transpose()?;
    bvh::write(&args.out, &document)?;
    if let Some((path, page)) = args.viewer.as_ref().zip(page) {
        replace_file(path, page)?;
    }
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    writeln!(std::io::stdout(), "{summary}{}", args.out.display())?;
    Ok(())
}

/// The beats that lie in a dance of so many frames.
fn within(beats: &[usize], frames: usize) -> Vec<usize> {
    beats
        .iter()
        .copied()
        .filter(|beat| *beat < frames)
        .collect()
}

/// Where a page finds a file: relative to it, so that both may move together.
fn address(file: &Path, page: &Path) -> anyhow::Result<String> {
    let absolute = |path: &Path| {
        let path = std::path::absolute(path).ok()?;
        Url::from_file_path(path).ok()
    };
    let relative = || absolute(page)?.make_relative(&absolute(file)?);
    relative().with_context(|| format!("{} has no address that a page could name", file.display()))
}

/// A sound file as a data URL.
fn embedded(file: &Path) -> anyhow::Result<String> {
    let content =
        std::fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    let kind = match content.get(..4) {
        Some(b"RIFF") => "wav",
        Some(b"fLaC") => "flac",
        Some(b"OggS") => "ogg",
        _ => "mpeg",
    };
    Ok(format!(
        "data:audio/{kind};base64,{}",
        BASE64_STANDARD.encode(content)
    ))
}

//! `keydance regenerate`: new dances to the music of a recorded one.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;

use super::notice::warn;
use crate::models::pu2022::Pu2022Settings;
use crate::motion::bvh;
use crate::music::Cache;
use crate::run::{Subject, check_output_folder};
use crate::synthesis::regenerate::regeneration;

/// Sound files that may lie beside a dance.
const ENDINGS: [&str; 4] = ["wav", "flac", "mp3", "ogg"];

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
    let settings = subject.config.model.downcast_ref::<Pu2022Settings>();
    let settings = settings.with_context(|| {
        let kind = subject.config.model.kind();
        format!(
            "{} is of kind {kind}: key poses are drawn as in the training of a model of kind pu2022",
            subject.what
        )
    })?;
    let music = args.music.clone().or_else(|| music_of(&args.clip));
    let music = music.with_context(|| {
        let clip = args.clip.display();
        format!("{clip} has no sound file of its name beside it; give --music SONG")
    })?;
    let own = args.clip.parent().unwrap_or(Path::new("")).join(".");
    if own
        .canonicalize()
        .is_ok_and(|own| args.out.canonicalize().is_ok_and(|out| out == own))
    {
        anyhow::bail!(
            "new dances in {} would stand among the recorded ones; give another folder to --out",
            args.out.display()
        );
    }
    check_output_folder(&args.out, args.force)?;
    let stem = args.clip.file_stem().unwrap_or_default().to_string_lossy();
    let (model, data, cache) = (
        subject.model.as_ref(),
        &subject.config.data,
        Cache::of_user(),
    );
    let mut out = std::io::stdout();
    for number in 1..=args.count {
        let place = [args.seed, number];
        let files = [args.clip.as_path(), music.as_path()];
        let song = regeneration(settings, model, files, data, place, &cache)?;
        if number == 1 {
            warn(&song.notices);
            std::fs::create_dir_all(&args.out)
                .with_context(|| format!("{} cannot be created", args.out.display()))?;
        }
        let name = format!("{stem}_{number:03}.bvh");
        let (dance, summary) = song.dance(model, &name)?;
        let document = song.document(&dance);
        let document = document.context("the motion cannot be written")?;
        let path = args.out.join(&name);
        bvh::write(&path, &document)?;
        writeln!(out, "{}  {}", path.display(), summary.about_key_poses())?;
    }
    Ok(())
}

/// The sound file of a dance's name beside it, or in a folder `audio` beside its own.
fn music_of(clip: &Path) -> Option<PathBuf> {
    let (folder, stem) = (clip.parent()?, clip.file_stem()?);
    let folders = [folder.to_path_buf(), folder.join("..").join("audio")];
    let files = folders.iter().flat_map(|folder| {
        ENDINGS.iter().map(move |ending| {
            let mut name = stem.to_os_string();
            name.push(".");
            name.push(ending);
            folder.join(name)
        })
    });
    files.into_iter().find(|file| file.is_file())
}

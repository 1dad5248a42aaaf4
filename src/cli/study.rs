//! `keydance study`: writes a page that people rate dances on, reads their ratings, prints what they
//! say.

use std::fs;
use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::file_units::FileUnits;
use super::notice::warn;
use crate::counted::counted;
use crate::data::DataConfig;
use crate::report::study::{
    Question, StudyAnalysis, StudyKey, StudyModel, StudyRequest, read_ratings,
};
use crate::report::viewer::Sound;
use crate::run::{FileError, check_outputs, check_outputs_beside, replace_file, write_json};

#[derive(Debug, Args)]
pub struct StudyArgs {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Write a page of clips that does not say whose they are, and the key of it
    ///
    /// Files of one name in the models' folders are one stimulus. Participants open study.html,
    /// rate, and send back the CSV file that the page saves; key.json is not for them.
    Page(PageArgs),
    /// Print means, 95 % intervals, an analysis of variance and pairs of models
    Analyse(AnalyseArgs),
}

#[derive(Debug, Args)]
struct PageArgs {
    /// A model's name and the folder of its dances (BVH); may be repeated
    #[arg(long = "model", value_name = "NAME=FOLDER", required = true)]
    models: Vec<StudyModel>,
    /// Folder of the songs: a sound file (wav, flac, mp3, ogg) of each dance's name
    #[arg(long, value_name = "DIR")]
    music: Option<PathBuf>,
    /// Put the sounds themselves into the page, which else looks for them where they are now; they
    /// may not be yours to pass on
    #[arg(long, requires = "music")]
    embed_music: bool,
    /// What is asked, in this order
    #[arg(long, value_enum, value_name = "NAME,..", value_delimiter = ',',
        default_values_t = Question::ALL)]
    questions: Vec<Question>,
    /// Longest clip, seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 15.0)]
    seconds: f64,
    /// Seconds at the beginning of every dance and its song that are left out, such as a seed that
    /// was recorded
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    skip: f64,
    /// What the clips' names and the participants' orders follow from
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    units: FileUnits,
    /// Folder for study.html and key.json, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct AnalyseArgs {
    /// Files that participants saved
    #[arg(value_name = "RATINGS.csv", required = true)]
    ratings: Vec<PathBuf>,
    /// The key of the study's page
    #[arg(long, value_name = "KEY.json")]
    key: PathBuf,
    /// Write what is printed here, too, as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write means, deviations and intervals as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// Dances, ratings or a key cannot be used; nothing is written then. A file cannot be written.
pub fn run(args: StudyArgs) -> anyhow::Result<()> {
    match args.action {
        Action::Page(args) => page(args),
        Action::Analyse(args) => analyse(args),
    }
}

fn page(args: PageArgs) -> anyhow::Result<()> {
    let [page, key] = ["study.html", "key.json"].map(|name| args.out.join(name));
    let folders = args.models.iter().map(|model| &model.folder);
    let inputs = folders.chain(&args.music);
    check_outputs_beside(Some(&args.out), [&page, &key], inputs, args.force)?;
    let sound = match args.embed_music {
        true => Sound::Embedded,
        false => Sound::Beside(&page),
    };
    let request = StudyRequest {
        data: args.units.over(&DataConfig::default()),
        models: args.models,
        music: args.music,
        questions: args.questions,
        seconds: args.seconds,
        skip: args.skip,
        seed: args.seed,
    };
    let study = request.make(sound)?;
    warn(&study.notices);
    fs::create_dir_all(&args.out).map_err(FileError::at(&args.out, "created"))?;
    replace_file(&page, &study.page)?;
    write_json(&key, &study.key)?;
    let clips = counted(study.key.clips.len(), "clip");
    let mut out = io::stdout();
    writeln!(out, "{}: {clips}", page.display())?;
    writeln!(
        out,
        "{}: whose they are, not for participants",
        key.display()
    )?;
    Ok(())
}

fn analyse(args: AnalyseArgs) -> anyhow::Result<()> {
    let inputs = args.ratings.iter().chain([&args.key]);
    check_outputs(args.json.iter().chain(&args.csv), inputs, args.force)?;
    let key = StudyKey::read(&args.key)?;
    let analysis = StudyAnalysis::new(&key, &read_ratings(&args.ratings, &key)?);
    let csv = analysis.csv()?;
    write!(io::stdout(), "{analysis}")?;
    if let Some(path) = &args.json {
        write_json(path, &analysis)?;
    }
    if let Some(path) = &args.csv {
        replace_file(path, csv)?;
    }
    Ok(())
}

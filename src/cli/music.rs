//! `keydance music`: reads a sound file, prints its tempo, metre and beats, writes its features.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::Args;
use ndarray_npy::WriteNpyExt as _;
use serde::Serialize;

use super::notice::warn;
use crate::counted::counted;
use crate::music::cache::Heard;
use crate::music::{Analysis, Cache, FRAME_RATE, FeatureSet, RATE};
use crate::run::{check_outputs, replace_file, write_json};

/// Print tempo, metre and beats of a sound file, and write its features
///
/// Wav, flac, mp3 and ogg (Vorbis) of any rate and number of channels, up to an hour: the mean of
/// the channels at 22,050 Hz, 30 frames a second, as librosa hears it. What was heard is remembered
/// by the file's content.
#[derive(Debug, Args)]
pub struct MusicArgs {
    /// Sound file
    file: PathBuf,
    /// Where to write the features of every frame: float32, not standardised
    #[arg(long, value_name = "OUT.npy")]
    npy: Option<PathBuf>,
    /// Which features to write
    #[arg(long, value_enum, default_value_t, requires = "npy")]
    features: FeatureSet,
    /// Write tempo, metre, beats, downbeats and onset peaks, in frames and seconds
    #[arg(long, value_name = "OUT.json")]
    json: Option<PathBuf>,
    /// Folder to remember what was heard in, in place of the user's cache folder
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Hear the file again, remember nothing
    #[arg(long, conflicts_with = "cache")]
    no_cache: bool,
    /// Replace files that are there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The file cannot be read or heard; nothing is written then. A file cannot be written.
pub fn run(args: MusicArgs) -> anyhow::Result<()> {
    let outputs = args.npy.iter().chain(&args.json);
    check_outputs(outputs, [&args.file], args.force)?;
    let cache = match &args.cache {
        _ if args.no_cache => Cache::none(),
        Some(folder) => Cache::at(folder),
        None => Cache::of_user(),
    };
    let Heard { analysis, warnings } = cache.analysis(&args.file)?;
    let file = args.file.display();
    warn(warnings.iter().map(|warning| format!("{file} {warning}")));
    let mut output = io::stdout().lock();
    print(&mut output, &analysis)?;
    if let Some(path) = &args.npy {
        let array = analysis.features(args.features);
        let mut content = Vec::new();
        array.write_npy(&mut content)?;
        replace_file(path, content)?;
        let (frames, numbers) = array.dim();
        let columns = args.features.columns();
        let path = path.display();
        writeln!(output, "{path}: float32 [{frames}, {numbers}]: {columns}")?;
    }
    if let Some(path) = &args.json {
        write_json(path, &Summary::of(&analysis, warnings))?;
    }
    Ok(())
}

fn print(output: &mut impl io::Write, analysis: &Analysis) -> io::Result<()> {
    writeln!(
        output,
        "{:.2} s, {} of 1/30 s",
        analysis.seconds(),
        counted(analysis.frames(), "frame")
    )?;
    if !analysis.has_onsets() {
        let why = if analysis.silent {
            "silent"
        } else {
            "nothing begins in it"
        };
        let tempo = analysis.tempo;
        return writeln!(output, "{why}: no beats; its tempo counts as {tempo:.2}");
    }
    writeln!(output, "tempo      {:.2} beats a minute", analysis.tempo)?;
    writeln!(output, "metre      {}", analysis.metre)?;
    let times = |frames: &[usize]| -> String {
        let times = seconds(frames)
            .into_iter()
            .map(|time| format!(" {time:.2}"));
        times.collect()
    };
    for (name, frames) in [
        ("beats", &analysis.beats),
        ("downbeats", &analysis.downbeats),
    ] {
        let (count, times) = (frames.len(), times(frames));
        writeln!(output, "{name:<10} {count}, at seconds{times}")?;
    }
    Ok(())
}

/// What `--json` writes.
#[derive(Debug, Serialize)]
struct Summary {
    seconds: f64,
    sample_rate: u32,
    samples: usize,
    frame_rate: f64,
    frames: usize,
    tempo_bpm: f64,
    metre: usize,
    beats: Vec<usize>,
    beat_seconds: Vec<f64>,
    downbeats: Vec<usize>,
    downbeat_seconds: Vec<f64>,
    onset_peaks: Vec<usize>,
    silent: bool,
    warnings: Vec<String>,
}

impl Summary {
    fn of(analysis: &Analysis, warnings: Vec<String>) -> Self {
        Self {
            seconds: analysis.seconds(),
            sample_rate: RATE,
            samples: analysis.samples,
            frame_rate: FRAME_RATE,
            frames: analysis.frames(),
            tempo_bpm: analysis.tempo,
            metre: analysis.metre,
            beat_seconds: seconds(&analysis.beats),
            beats: analysis.beats.clone(),
            downbeat_seconds: seconds(&analysis.downbeats),
            downbeats: analysis.downbeats.clone(),
            onset_peaks: analysis.onset_peaks.clone(),
            silent: analysis.silent,
            warnings,
        }
    }
}

fn seconds(frames: &[usize]) -> Vec<f64> {
    frames
        .iter()
        .map(|&frame| frame as f64 / FRAME_RATE)
        .collect()
}

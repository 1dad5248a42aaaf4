//! `keydance music`: reads a sound file, prints its tempo, metre and beats, writes its features.

use std::io::{self, Write as _};
use std::path::PathBuf;

use clap::Args;
use ndarray_npy::WriteNpyExt as _;

use super::notice::warn;
use crate::music::{Cache, FeatureSet, Summary};
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
    let heard = cache.analysis(&args.file)?;
    let file = args.file.display();
    let named = |warning| format!("{file} {warning}");
    warn(heard.warnings.iter().map(named));
    let mut output = io::stdout().lock();
    let summary = Summary::from(&heard);
    write!(output, "{summary}")?;
    if let Some(path) = &args.npy {
        let array = heard.analysis.features(args.features);
        let mut content = Vec::new();
        array.as_standard_layout().write_npy(&mut content)?;
        replace_file(path, content)?;
        let (frames, numbers) = array.dim();
        let columns = args.features.columns();
        let path = path.display();
        writeln!(output, "{path}: float32 [{frames}, {numbers}]: {columns}")?;
    }
    if let Some(path) = &args.json {
        write_json(path, &summary)?;
    }
    Ok(())
}

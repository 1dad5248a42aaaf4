//! `keydance figures`: reads a run's folder and a data folder, writes the paper's figures with
//! captions and numbers.

use std::collections::HashSet;
use std::io::Write as _;
use std::path::PathBuf;

use anyhow::bail;
use clap::Args;

use super::list::name;
use super::notice::warn;
use super::threads::Threads;
use crate::data::Dataset;
use crate::experiment::EvaluatedRun;
use crate::report::figures::{FigureRequest, drawing_of, write_all};
use crate::run::{Subject, check_output_folder, check_outputs_beside, replace_file};

/// Draw the figures of the model's paper: 4 (b) to 12 of Pan et al. 2021 (13 of its cyclic motion),
/// 3 to 10 of Li et al., 4 to 9 of Pu and Shan, 3 of Valle-Pérez et al.
///
/// Each is an SVG with a caption, its numbers as CSV beside it. A figure shows one transition of a
/// test clip, or of each that --clip names: by default the one in the middle of the first. Captions
/// and CSV files give means over such a transition of every test clip that is long enough. A model
/// of Pan et al. follows a control where it gives at least a third of the change that is asked for;
/// the captions of figures 6 to 9 say so where it does not. Figures 3 and 4 of Li et al. need the
/// rows mix_embedding and slerp, position_loss and contact_loss beside the model. Figures 5 and 6
/// of Pu and Shan are over evaluated rows, figure 7 is of the model's own scores; figures 8 and 9
/// show the beginning of the first test clip by name. Figure 3 of Valle-Pérez et al. shows the
/// tempi of a test clip's song and of dances to it by the model and those of --compare. Motion is
/// shown as the model predicts it, neither bent onto the keyframes nor cleaned up.
#[derive(Debug, Args)]
pub struct FiguresArgs {
    /// Folder of a run, or the config of a model that needs no training
    #[arg(value_name = "RUN_DIR_OR_CONFIG")]
    run: PathBuf,
    /// Folder of BVH files, or what prepare made of one; the run's config says which of them test
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// Folder for the figures
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// A run to set beside: in figures 11 to 13 of Pan et al., 3 to 6 of Li et al.; may be
    /// repeated
    #[arg(long, value_name = "RUN_DIR_OR_CONFIG")]
    compare: Vec<PathBuf>,
    /// Folder of evaluated rows, such as `keydance reproduce` writes: for figures 5 to 7 of Pu and
    /// Shan
    #[arg(long, value_name = "DIR")]
    rows: Option<PathBuf>,
    /// Test clips to show, by their file names; several get a folder each, without --viewer and
    /// --start [default: the first by name]
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = name)]
    clip: Vec<String>,
    /// First keyframe in that clip [default: the transition is in its middle]; first frame of the
    /// dance for Pu and Shan [default: 0]
    #[arg(long, value_name = "FRAME")]
    start: Option<usize>,
    /// Frames from keyframe to keyframe [default: 100 for Pan et al., 50 of its cyclic motion, 30
    /// for Li et al.]; of the dance, with its seed, for Pu and Shan [default: 240]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=10_000))]
    length: Option<u16>,
    /// Show the transition in the motion viewer, too: one HTML page
    #[arg(long, value_name = "OUT.html")]
    viewer: Option<PathBuf>,
    /// Take other data than the run was trained on
    #[arg(long)]
    other_data: bool,
    /// Replace figures and page where they are there already
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: Threads,
}

/// # Errors
/// A run or the data cannot be used, do not fit each other, or a model fails on them; nothing is
/// written then. A file cannot be written.
pub fn run(args: FiguresArgs) -> anyhow::Result<()> {
    let mut names = args.clip;
    let mut seen = HashSet::new();
    names.retain(|name| seen.insert(name.clone()));
    if names.len() > 1 && (args.viewer.is_some() || args.start.is_some()) {
        bail!(
            "--viewer and --start are for one clip; --clip names {}",
            names.len()
        );
    }
    let mut subject = Subject::open(&args.run, &[])?;
    let compared = args.compare.iter().map(|path| Subject::open(path, &[]));
    let mut compared = compared.collect::<Result<Vec<_>, _>>()?;
    let models = || compared.iter().chain([&subject]);
    let inputs: Vec<PathBuf> = models().flat_map(Subject::files).collect();
    let inputs = inputs.iter().chain([&args.data]).chain(&args.rows);
    check_outputs_beside(Some(&args.out), &args.viewer, inputs, args.force)?;
    check_output_folder(&args.out, args.force)?;
    let draw = drawing_of(&subject)?;
    let dataset = Dataset::load(&args.data, &subject.config.data)?;
    warn(&dataset.warnings);
    if !args.other_data {
        models().try_for_each(|model| model.check_data(&dataset, &args.data))?;
    }
    for model in compared.iter_mut().chain([&mut subject]) {
        model.model.look_up_in(&dataset.train)?;
    }
    let rows = match &args.rows {
        Some(folder) => EvaluatedRun::rows_in(folder, (!args.other_data).then_some(&dataset))?,
        None => Vec::new(),
    };
    let pool = args.threads.pool()?;
    let mut clips: Vec<Option<&str>> = names.iter().map(|clip| Some(clip.as_str())).collect();
    if clips.is_empty() {
        clips.push(None);
    }
    let mut drawn = Vec::new();
    for clip in clips {
        let asked = FigureRequest {
            subject: &subject,
            compared: &compared,
            rows: &rows,
            dataset: &dataset,
            length: args.length.map(usize::from),
            clip,
            start: args.start,
            page: args.viewer.is_some(),
        };
        drawn.push((asked, pool.install(|| draw(&asked))?));
    }
    write_all(&args.out, &drawn)?;
    let mut out = std::io::stdout();
    let several = drawn.len() > 1;
    for (asked, drawn) in drawn {
        if let Some(clip) = asked.clip.filter(|_| several) {
            writeln!(out, "{clip}:")?;
        }
        if let Some((path, page)) = args.viewer.as_ref().zip(drawn.page) {
            replace_file(path, page)?;
        }
        for figure in &drawn.figures {
            writeln!(out, "{}", figure.caption)?;
        }
        for sentence in &drawn.left_out {
            writeln!(out, "{sentence}")?;
        }
    }
    writeln!(out, "{}", args.out.display())?;
    Ok(())
}

//! `keydance export-batch`: a batch with a trained model's outputs, losses and gradients, for
//! comparison with another implementation (`scripts/compare_pytorch.py check`).

use std::path::PathBuf;

use anyhow::Context as _;
use clap::Args;

use super::notice::warn;
use crate::data::Dataset;
use crate::models::transition::exported_batch::{ExportedBatch, export_batch};
use crate::models::transition::{DanceClip, Forcing, TransitionSettings};
use crate::run::{RunFolder, check_outputs, replace_file};

#[derive(Debug, Args)]
pub struct ExportBatchArgs {
    /// Folder of a run
    run: PathBuf,
    /// Folder of BVH files; windows come from its training clips
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// File to write, safetensors
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Frames of a transition
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u16).range(1..=1000))]
    frames: u16,
    /// Windows in the batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    windows: u16,
    /// Feed the true frames instead of the model's predictions
    #[arg(long)]
    ground_truth: bool,
    /// Replace the file where it is there already
    #[arg(long)]
    force: bool,
}

/// # Errors
/// The run or the data cannot be used; no clip is long enough; the file cannot be written.
pub fn run(args: ExportBatchArgs) -> anyhow::Result<()> {
    let run = RunFolder::open(&args.run);
    let inputs = run.parts();
    check_outputs([&args.out], inputs.iter().chain([&args.data]), args.force)?;
    let config = run.config()?;
    let settings = TransitionSettings::of(&config);
    let settings = settings.context("only a model of transitions has batches to export")?;
    let model = settings.load(&config.name, &run.saved_weights(&config)?)?;
    let dataset = Dataset::load(&args.data, &config.data)?;
    warn(&dataset.warnings);
    let clips = DanceClip::measure_all(&dataset.train, &config.data.features())?;
    let batch = ExportedBatch {
        frames: args.frames.into(),
        windows: args.windows.into(),
        forcing: match args.ground_truth {
            true => Forcing::Teacher,
            false => Forcing::FreeRunning,
        },
    };
    let file = export_batch(&model, settings.model.root_frame(), &clips, &batch)?;
    Ok(replace_file(&args.out, file)?)
}

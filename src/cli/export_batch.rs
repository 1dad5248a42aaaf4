//! `keydance export-batch`: a batch with a trained model's outputs, losses and gradients, for
//! comparison with another implementation (`scripts/compare_pytorch.py check`).

use std::path::PathBuf;

use clap::Args;

use super::notice::warn;
use crate::data::Dataset;
use crate::models::exported_batch::ExportOptions;
use crate::run::{RunFolder, check_outputs, replace_file};

#[derive(Debug, Args)]
pub struct ExportBatchArgs {
    /// Folder of a run
    run: PathBuf,
    /// Folder of BVH files, or what prepare made of one; windows come from its training clips
    #[arg(long, value_name = "DIR")]
    data: PathBuf,
    /// File to write, safetensors
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Frames of a transition; for a model of rotations of a window, its keyframes among them
    /// [default: 30; a model that dances to music has windows of one length only]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1000))]
    frames: Option<u16>,
    /// Windows in the batch
    #[arg(long, default_value_t = 16, value_parser = clap::value_parser!(u16).range(1..=1024))]
    windows: u16,
    /// Feed the true frames instead of the model's predictions, where it is fed these
    #[arg(long)]
    ground_truth: bool,
    /// Compute in f64; models of rotations alone can
    #[arg(long)]
    f64: bool,
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
    let dataset = Dataset::load(&args.data, &config.data)?;
    warn(&dataset.warnings);
    let options = ExportOptions {
        frames: args.frames.map(usize::from),
        windows: args.windows.into(),
        ground_truth: args.ground_truth,
        double: args.f64,
    };
    let batch = run.export_batch(&config, &dataset, &options)?;
    Ok(replace_file(&args.out, batch.to_safetensors()?)?)
}

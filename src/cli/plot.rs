//! `keydance plot`: curves of trainings.

use std::io::Write as _;
use std::path::PathBuf;

use clap::Args;

use crate::experiment::Curves;
use crate::run::{check_output_folder, replace_file};

/// Draw losses, validation scores and learning rate over the course of trainings
///
/// Of one run every loss term and every column of the first validation metric, of several the total
/// and the metric's average side by side. The numbers are those of the runs' log.jsonl; a training
/// may still be going on.
#[derive(Debug, Args)]
pub struct PlotArgs {
    /// Folders of runs
    #[arg(value_name = "RUN_DIR", required = true)]
    runs: Vec<PathBuf>,
    /// Folder for the figures, SVG
    #[arg(long, value_name = "DIR", required_unless_present = "tensorboard")]
    out: Option<PathBuf>,
    /// Folder for event files, one a run, which TensorBoard shows: tensorboard --logdir DIR
    #[arg(long, value_name = "DIR")]
    tensorboard: Option<PathBuf>,
    /// Write into folders that hold other files
    #[arg(long)]
    force: bool,
}

/// # Errors
/// A folder is no run's, or has no steps in its log; a file cannot be written.
pub fn run(args: PlotArgs) -> anyhow::Result<()> {
    let curves = Curves::read(&args.runs)?;
    for folder in args.out.iter().chain(&args.tensorboard) {
        check_output_folder(folder, args.force)?;
    }
    let mut out = std::io::stdout();
    if let Some(folder) = &args.out {
        let drawn = curves.drawn()?;
        std::fs::create_dir_all(folder)?;
        for (name, curve) in drawn {
            let file = folder.join(name);
            replace_file(&file, curve)?;
            writeln!(out, "{}", file.display())?;
        }
    }
    if let Some(folder) = &args.tensorboard {
        for file in curves.write_event_files(folder)? {
            writeln!(out, "{}", file.display())?;
        }
    }
    Ok(())
}

//! `keydance tables`: reads runs' folders that `keydance evaluate` has been through, writes a Markdown file.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::evaluation::{EvaluatedData, EvaluationRecord, TableRow, markdown_tables};
use crate::experiment::ExperimentConfig;
use crate::optim::{AdamConfig, RateShape};
use crate::report::thousands;
use crate::run::{Manifest, RunFolder, RunState, replace_file};

#[derive(Debug, Args)]
pub struct TablesArgs {
    /// Folders of evaluated runs, and folders that `keydance evaluate CONFIG --out DIR` made
    #[arg(value_name = "RUN_DIR", required = true)]
    runs: Vec<PathBuf>,
    /// Where to write the tables, Markdown
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// # Errors
/// A folder has no scores, or the scores are of different data; nothing is written then. The file cannot be written.
pub fn run(args: TablesArgs) -> anyhow::Result<()> {
    let runs: Vec<Evaluated> = args
        .runs
        .iter()
        .map(|folder| Evaluated::read(folder))
        .collect::<anyhow::Result<_>>()?;
    same_data(&runs)?;
    let rows: Vec<TableRow> = runs.iter().map(Evaluated::row).collect();
    let subject = runs
        .first()
        .map_or_else(String::new, |run| run.record.data.caption());
    replace_file(&args.out, markdown_tables(&rows, &subject).as_bytes())?;
    writeln!(std::io::stdout(), "{}", args.out.display())?;
    Ok(())
}

/// A run with its scores.
struct Evaluated {
    folder: PathBuf,
    config: ExperimentConfig,
    /// None where nothing was trained.
    manifest: Option<Manifest>,
    record: EvaluationRecord,
}

impl Evaluated {
    fn read(folder: &Path) -> anyhow::Result<Self> {
        let run = RunFolder::open(folder);
        let record = EvaluationRecord::read(folder)?;
        Ok(Self {
            config: run.config()?,
            manifest: run.manifest()?,
            record,
            folder: folder.into(),
        })
    }

    fn row(&self) -> TableRow {
        TableRow {
            name: self.config.name.clone(),
            seed: self.manifest.as_ref().map(|manifest| manifest.seed),
            evaluation: Some(self.record.evaluation.clone()),
            schedule_note: self.manifest.as_ref().map_or_else(
                || NO_TRAINING.into(),
                |manifest| schedule_note(&self.config, manifest),
            ),
        }
    }
}

/// The note of a model that has no weights.
pub const NO_TRAINING: &str = "needs no training";

/// The budget of a training, for a caption; all but the seed.
pub fn schedule_note(config: &ExperimentConfig, manifest: &Manifest) -> String {
    let done = manifest.frame_steps_done;
    let mut note = format!("{} frame-steps", thousands(done));
    if let Some(whole) = manifest.whole_schedule_frame_steps {
        note += &format!(
            " ({:.3} % of the whole schedule's {})",
            100.0 * done as f64 / whole as f64,
            thousands(whole)
        );
    }
    note += &format!(
        ", schedule.fraction {}, batch size {}, {}",
        config.schedule.fraction,
        config.schedule.batch_size,
        learning_rate(&config.optimiser)
    );
    if manifest.state != RunState::Finished {
        note += &format!(
            "; not finished: {} of {} steps",
            manifest.steps_done, manifest.steps
        );
    }
    note
}

fn learning_rate(optimiser: &AdamConfig) -> String {
    let rate = optimiser.learning_rate;
    let mut text = format!("learning rate {rate}");
    if let Some(rate) = optimiser.transformer_learning_rate {
        text += &format!(" ({rate} for Transformers)");
    }
    let Some(schedule) = optimiser.rate_schedule else {
        return text;
    };
    if schedule.warmup_steps > 0 {
        text += &format!(" after {} steps of warm-up", schedule.warmup_steps);
    }
    let shape = match schedule.shape {
        RateShape::Constant => return text,
        RateShape::Linear => "linearly",
        RateShape::Cosine => "as a cosine",
    };
    text + &format!(", falling {shape} to {}", rate * schedule.final_share)
}

/// Scores stand side by side only if they were measured on the same windows.
fn same_data(runs: &[Evaluated]) -> anyhow::Result<()> {
    for pair in runs.windows(2) {
        let [a, b] = pair else { continue };
        let measured = |run: &Evaluated| {
            let data = &run.record.data;
            format!(
                "{} on {} test clips ({} frames, windows by length {:?}) of data with digest {}",
                run.folder.display(),
                data.clips,
                data.frames,
                run.record.evaluation.windows,
                data.data_digest
            )
        };
        let key = |run: &Evaluated| {
            let EvaluatedData {
                clips,
                frames,
                data_digest,
                ..
            } = run.record.data.clone();
            (
                clips,
                frames,
                data_digest,
                run.record.evaluation.windows.clone(),
            )
        };
        if key(a) != key(b) {
            anyhow::bail!(
                "scores of different data do not stand in one table: {}, but {}",
                measured(a),
                measured(b)
            );
        }
    }
    Ok(())
}

//! `keydance tables`: reads runs' folders that `keydance evaluate` has been through, writes a Markdown file.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;

use super::evaluation_record::{EvaluatedData, EvaluationRecord};
use crate::evaluation::{TableRow, markdown_tables, paper};
use crate::training::{ExperimentConfig, Manifest, RunFolder, RunState, replace_file};

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
        .map_or_else(String::new, |run| subject(&run.record.data));
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
            evaluation: self.record.evaluation.clone(),
            schedule_note: self.manifest.as_ref().map_or_else(
                || "needs no training".into(),
                |manifest| schedule_note(&self.config, manifest),
            ),
        }
    }
}

/// The budget of a training and its seed, for a caption.
pub fn schedule_note(config: &ExperimentConfig, manifest: &Manifest) -> String {
    let done = manifest.frame_steps_done;
    let mut note = format!(
        "schedule.fraction {}, {} frame-steps ({:.3} % of the paper's {:.1e}), seed {}",
        config.schedule.fraction,
        thousands(done),
        100.0 * done as f64 / paper::FRAME_STEPS,
        paper::FRAME_STEPS,
        manifest.seed
    );
    if manifest.state != RunState::Finished {
        note += &format!(
            "; not finished: {} of {} steps",
            manifest.steps_done, manifest.steps
        );
    }
    note
}

/// What the scores were measured on, for a caption.
fn subject(data: &EvaluatedData) -> String {
    format!(
        "{} test clips, {} frames, of the data with digest {}",
        data.clips,
        thousands(data.frames as u64),
        data.data_digest
    )
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

/// 1234567 as "1,234,567".
pub fn thousands(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_parted_from_the_right() {
        let texts = [0, 999, 1000, 123_456, 1_234_567].map(thousands);
        assert_eq!(texts, ["0", "999", "1,000", "123,456", "1,234,567"]);
    }
}

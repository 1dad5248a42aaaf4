//! A table of the runs in a folder: what became of each.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use super::thousands;
use crate::evaluation::scores::AVERAGE;
use crate::evaluation::{EvaluationRecord, Protocol, ProtocolScores};
use crate::experiment::ExperimentConfig;
use crate::run::{RunError, RunFolder, RunProgress, RunState};

/// Folders inside folders that are looked through for runs.
const DEEPEST: usize = 4;
/// Transition lengths whose LRP is shown, frames.
const LENGTHS: [usize; 4] = [10, 50, 100, 150];
const HEADER: [&str; 13] = [
    "run",
    "name",
    "state",
    "steps",
    "%",
    "frame-steps",
    "frames/s",
    "LRP 10",
    "50",
    "100",
    "150",
    "score",
    "made by",
];
/// Columns of scores: each is left out where no run has any in it.
const LRP: usize = 7;
const SCORE: usize = LRP + LENGTHS.len();
const MADE_BY: usize = SCORE + 1;
/// Columns of text; the others hold numbers and are aligned on the right.
const TEXT: [usize; 5] = [0, 1, 2, SCORE, MADE_BY];

/// The runs at and below a folder, by their paths; its `Display` is a table, and a line for each
/// thing that is wrong with a run.
pub struct RunTable {
    rows: Vec<RunLine>,
}

impl RunTable {
    /// Reads the runs of a folder. A damaged run has a row that says so.
    ///
    /// # Errors
    /// The folder cannot be read, or holds no run.
    pub fn of(folder: &Path) -> Result<Self, RunError> {
        let mut folders = Vec::new();
        let refused = |problem| Err(RunError::Refused(problem));
        let name_of_it = folder.display();
        if let Err(cause) = find(folder, DEEPEST, &mut folders) {
            return refused(format!("the folder {name_of_it} cannot be read: {cause}"));
        }
        if folders.is_empty() {
            return refused(format!(
                "{name_of_it} holds no run: no folder in it has a {}; `keydance train` makes one",
                RunFolder::CONFIG
            ));
        }
        folders.sort_unstable();
        let rows = folders
            .iter()
            .map(|run| RunLine::read(run, name(run, folder)));
        Ok(Self {
            rows: rows.collect(),
        })
    }
}

impl fmt::Display for RunTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let header = HEADER.map(String::from);
        let rows = self.rows.iter().map(|row| &row.cells);
        let lines = || std::iter::once(&header).chain(rows.clone());
        let widths: [usize; HEADER.len()] = std::array::from_fn(|column| {
            let cells = lines().map(|line| line[column].chars().count());
            cells.max().unwrap_or_default()
        });
        let is_shown = |column: usize| {
            let mut rows = self.rows.iter();
            !(LRP..MADE_BY).contains(&column) || rows.any(|row| !row.cells[column].is_empty())
        };
        let shown: Vec<usize> = (0..HEADER.len()).filter(|&it| is_shown(it)).collect();
        for line in lines() {
            let cells = shown.iter().map(|&column| {
                let (cell, width) = (&line[column], widths[column]);
                match TEXT.contains(&column) {
                    true => format!("{cell:<width$}"),
                    false => format!("{cell:>width$}"),
                }
            });
            let line = cells.collect::<Vec<_>>().join("  ");
            writeln!(f, "{}", line.trim_end())?;
        }
        for row in &self.rows {
            for problem in &row.problems {
                writeln!(f, "{}: {problem}", row.cells[0])?;
            }
        }
        Ok(())
    }
}

/// Adds the runs' folders at and below a folder.
fn find(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    if folder.join(RunFolder::CONFIG).is_file() {
        found.push(folder.into());
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        // Links are not followed: they may lead back.
        if depth > 0 && entry.file_type()?.is_dir() {
            // A folder inside that cannot be read holds nothing to list.
            let _ = find(&entry.path(), depth - 1, found);
        }
    }
    Ok(())
}

/// What to call a run: its path below the folder that is listed.
fn name(run: &Path, folder: &Path) -> String {
    match run.strip_prefix(folder) {
        Ok(rest) if !rest.as_os_str().is_empty() => rest.display().to_string(),
        _ => run.display().to_string(),
    }
}

/// A line of the table, and what is wrong with the run.
#[derive(Default)]
struct RunLine {
    cells: [String; HEADER.len()],
    problems: Vec<String>,
}

impl RunLine {
    fn read(folder: &Path, name: String) -> Self {
        let mut row = Self::default();
        row.cells[0] = name;
        if let Err(error) = row.fill(&RunFolder::open(folder)) {
            row.cells[2] = "damaged".into();
            row.problems.push(error.to_string());
        }
        match EvaluationRecord::read(folder) {
            Ok(record) => row.score(&record, &RunFolder::open(folder)),
            Err(error) if EvaluationRecord::is_in(folder) => row.problems.push(error.to_string()),
            Err(_) => {}
        }
        row
    }

    fn fill(&mut self, run: &RunFolder) -> Result<(), RunError> {
        // First what needs no config: it may be of another version.
        let progress = run.progress()?;
        if let Some(progress) = &progress {
            self.progress(progress);
        }
        let config = run.config()?;
        self.cells[1] = config.name.clone();
        self.cells[2] = state(&config, progress.as_ref(), run).into();
        Ok(())
    }

    fn progress(&mut self, progress: &RunProgress) {
        let manifest = &progress.manifest;
        let share = progress.steps_done as f64 / manifest.steps.max(1) as f64;
        self.cells[1] = manifest.name.clone();
        self.cells[3] = format!("{}/{}", progress.steps_done, manifest.steps);
        self.cells[4] = format!("{:.0}", (100.0 * share).floor());
        self.cells[5] = thousands(progress.frame_steps_done);
        if let Some(speed) = progress.frame_steps_per_second {
            self.cells[6] = format!("{speed:.0}");
        }
        self.cells[MADE_BY] = version(&manifest.version, manifest.commit.as_deref());
    }

    fn score(&mut self, record: &EvaluationRecord, run: &RunFolder) {
        let EvaluationRecord { scores, data } = record;
        if self.cells[MADE_BY].is_empty() {
            self.cells[MADE_BY] = version(&data.version, data.commit.as_deref());
        }
        for (cell, length) in self.cells[LRP..].iter_mut().zip(LENGTHS) {
            let mut protocols = scores.iter();
            if let Some(score) = protocols.find_map(|(_, scores)| scores.row("lrp")?.at(length)) {
                *cell = format!("{score:.1}");
            }
        }
        let is_empty = |cell: &String| cell.is_empty();
        if self.cells[LRP..SCORE].iter().all(is_empty)
            && let Ok(config) = run.config()
        {
            let score = first_score(&config.protocols(), scores);
            self.cells[SCORE] = score.unwrap_or_default();
        }
    }
}

/// The first metric of the first of these protocols, by its name: its mean over all columns where
/// there is one, else its first column, such as "L2Q, local 0.41 (N = 10)".
fn first_score(protocols: &[Box<dyn Protocol>], scores: &ProtocolScores) -> Option<String> {
    let protocol = protocols.first()?;
    let metric = protocol.metrics().first()?;
    let row = scores.by(protocol.name())?.row(metric.key)?;
    let mean = row.columns().find(|column| *column == AVERAGE);
    let column = mean.or_else(|| row.columns().next())?;
    let (title, digits, score) = (metric.title, metric.decimals, row.at(column)?);
    let column = match column.parse::<u64>() {
        Ok(number) => format!("{} = {number}", protocol.number()),
        Err(_) => column.into(),
    };
    Some(format!("{title} {score:.digits$} ({column})"))
}

/// A version and the first digits of its commit.
fn version(version: &str, commit: Option<&str>) -> String {
    let short: String = commit.unwrap_or_default().chars().take(7).collect();
    format!("{version} {short}").trim_end().into()
}

fn state(
    config: &ExperimentConfig,
    progress: Option<&RunProgress>,
    run: &RunFolder,
) -> &'static str {
    let Some(progress) = progress else {
        return match config.model.untrained(&config.data) {
            Some(_) => "needs no training",
            None => "not begun",
        };
    };
    match progress.manifest.state {
        RunState::Running if progress.is_running => "running",
        RunState::Running => "interrupted",
        RunState::Stopped => "stopped",
        RunState::Diverged => "diverged",
        RunState::Finished if run.weights().exists() => "finished",
        RunState::Finished => "finished, no weights",
    }
}

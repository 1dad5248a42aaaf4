//! `log.jsonl`: a line for every step that is logged.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead as _, BufReader, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::durable::FileError;
use super::error::RunError;
use crate::evaluation::Scores;
use crate::training::StepReport;

/// Bytes at the end of a log that hold a whole line.
const LAST_LINES: u64 = 1 << 14;

/// What figures need of a line.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct LogLine {
    pub step: u64,
    /// Frames predicted so far.
    pub frame_steps: u64,
    pub total: f64,
    pub losses: BTreeMap<String, f64>,
    pub learning_rate: f64,
    pub gradient_norm: f64,
    /// Wall-clock time of the step.
    pub seconds: f64,
    /// Scores on validation clips after the step, where it was scored.
    #[serde(default)]
    pub validation: Option<Scores>,
}

/// The lines of a log; none where there is none. A last line that a kill cut off is left out.
///
/// # Errors
/// The file cannot be read, or a line of it is no log line.
pub(crate) fn read(path: &Path) -> Result<Vec<LogLine>, RunError> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = std::fs::read_to_string(path).map_err(FileError::at(path, "read"))?;
    let whole = text.rfind('\n').map_or("", |end| &text[..end]);
    let parse = |(index, line)| {
        serde_json::from_str(line).map_err(|cause| {
            let (path, line) = (path.display(), index + 1);
            RunError::Refused(format!(
                "{path}, line {line}, is no line of a training's log: {cause}"
            ))
        })
    };
    whole.lines().enumerate().map(parse).collect()
}

/// How far a line of a log says that the training is.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(crate) struct Progress {
    pub step: u64,
    pub frame_steps: u64,
    pub frame_steps_per_second: f64,
}

/// The last whole line, if there is one, without reading the others.
pub(crate) fn last(path: &Path) -> Option<Progress> {
    let mut file = File::open(path).ok()?;
    let len = file.metadata().ok()?.len();
    file.seek(SeekFrom::Start(len.saturating_sub(LAST_LINES)))
        .ok()?;
    let mut tail = Vec::new();
    file.read_to_end(&mut tail).ok()?;
    let end = tail.iter().rposition(|&byte| byte == b'\n')?;
    let line = tail[..end].rsplit(|&byte| byte == b'\n').next()?;
    serde_json::from_slice(line).ok()
}

/// A log, open for more lines.
pub(crate) struct Log {
    path: PathBuf,
    file: File,
}

impl Log {
    /// Opens a run's log and cuts it back to the lines of the first `steps` steps.
    ///
    /// # Errors
    /// The file cannot be read or written.
    pub fn open(path: PathBuf, steps: u64) -> Result<Self, FileError> {
        let at = |action| FileError::at(&path, action);
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .read(true)
            .open(&path)
            .map_err(at("written"))?;
        let mut reader = BufReader::new(&file);
        let (mut kept, mut line) = (0, Vec::new());
        loop {
            line.clear();
            let read = reader.read_until(b'\n', &mut line).map_err(at("read"))?;
            let whole = line.ends_with(b"\n");
            match serde_json::from_slice::<Progress>(&line) {
                Ok(at) if whole && at.step <= steps => kept += read as u64,
                _ => break,
            }
        }
        file.set_len(kept).map_err(at("written"))?;
        Ok(Self { path, file })
    }

    /// Adds a line.
    pub fn write(&mut self, report: &StepReport) -> Result<(), FileError> {
        let line = serde_json::to_vec(report).map_err(std::io::Error::from);
        line.and_then(|mut line| {
            line.push(b'\n');
            self.file.write_all(&line)
        })
        .map_err(FileError::at(&self.path, "written"))
    }

    /// Makes what was written last.
    pub fn sync(&self) -> Result<(), FileError> {
        self.file
            .sync_data()
            .map_err(FileError::at(&self.path, "written"))
    }
}

//! A model's scores in a folder: `evaluation.json`, and `evaluation_data.json` that says on what they were measured.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::data::{DanceClip, Dataset};
use crate::evaluation::Evaluation;
use crate::training::replace_file;

const SCORES: &str = "evaluation.json";
const DATA: &str = "evaluation_data.json";

/// What a model was evaluated on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluatedData {
    pub test_clips: usize,
    pub test_frames: usize,
    /// Digest of the whole data set, see [`Dataset::digest`].
    pub data_digest: String,
    /// Version of keydance that evaluated, and its commit where it was built in a git checkout.
    pub version: String,
    pub commit: Option<String>,
}

impl EvaluatedData {
    pub fn of(dataset: &Dataset) -> Self {
        Self {
            test_clips: dataset.test.len(),
            test_frames: dataset.test.iter().map(DanceClip::frames).sum(),
            data_digest: dataset.digest.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("KEYDANCE_COMMIT").map(Into::into),
        }
    }
}

/// Scores and what they were measured on.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    pub evaluation: Evaluation,
    pub data: EvaluatedData,
}

impl EvaluationRecord {
    /// Names of the files.
    pub const FILES: [&str; 2] = [SCORES, DATA];

    /// Writes both files into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        write_json(&folder.join(DATA), &self.data)?;
        write_json(&folder.join(SCORES), &self.evaluation)
    }

    /// Reads what [`EvaluationRecord::write`] wrote.
    ///
    /// # Errors
    /// The folder has no scores (the error says how to get them), or a file is damaged.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        Ok(Self {
            evaluation: read_json(folder, SCORES)?,
            data: read_json(folder, DATA)?,
        })
    }
}

/// Writes JSON with a final line end.
///
/// # Errors
/// The file cannot be written.
pub fn write_json(path: &Path, content: &impl Serialize) -> anyhow::Result<()> {
    let mut text = serde_json::to_vec_pretty(content)
        .with_context(|| format!("{} cannot be written", path.display()))?;
    text.push(b'\n');
    Ok(replace_file(path, &text)?)
}

fn read_json<T: DeserializeOwned>(folder: &Path, name: &str) -> anyhow::Result<T> {
    let path: PathBuf = folder.join(name);
    let remedy = || {
        format!(
            "run `keydance evaluate {} --data DIR` (a config: `keydance evaluate CONFIG --data DIR --out {}`)",
            folder.display(),
            folder.display()
        )
    };
    if !path.exists() {
        anyhow::bail!(
            "{} has no {name}; to get one, {}",
            folder.display(),
            remedy()
        );
    }
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{} cannot be read", path.display()))?;
    serde_json::from_str(&text).with_context(|| {
        format!(
            "{} holds no scores; to get some, {}",
            path.display(),
            remedy()
        )
    })
}

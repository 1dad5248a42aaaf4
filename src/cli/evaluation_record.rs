//! A model's scores in a folder: `evaluation.json`, and `evaluation_data.json` that says on what they were measured. Scores on other
//! clips than the test clips have files of their own, such as `evaluation_validation.json`.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::clip_choice::ClipChoice;
use crate::data::{DanceClip, Dataset};
use crate::evaluation::Evaluation;
use crate::run::replace_file;

/// What a model was evaluated on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluatedData {
    /// Which part of the data set.
    #[serde(default)]
    pub part: ClipChoice,
    #[serde(alias = "test_clips")]
    pub clips: usize,
    #[serde(alias = "test_frames")]
    pub frames: usize,
    /// Digest of the whole data set, see [`Dataset::digest`].
    pub data_digest: String,
    /// Version of keydance that evaluated, and its commit where it was built in a git checkout.
    pub version: String,
    pub commit: Option<String>,
}

impl EvaluatedData {
    /// # Errors
    /// The data set has no such clips.
    pub fn of(dataset: &Dataset, part: ClipChoice) -> anyhow::Result<Self> {
        let clips = part.of(dataset)?;
        Ok(Self {
            part,
            clips: clips.len(),
            frames: clips.iter().map(DanceClip::frames).sum(),
            data_digest: dataset.digest.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("KEYDANCE_COMMIT").map(Into::into),
        })
    }
}

/// Scores and what they were measured on.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    pub evaluation: Evaluation,
    pub data: EvaluatedData,
}

/// The JSON of scores. Those on the test clips are no more than the scores.
#[derive(Serialize)]
struct Scores<'a> {
    #[serde(skip_serializing_if = "ClipChoice::is_test")]
    clips: ClipChoice,
    #[serde(flatten)]
    evaluation: &'a Evaluation,
}

impl EvaluationRecord {
    /// Names of the files: scores, and what they were measured on.
    pub fn files(part: ClipChoice) -> [&'static str; 2] {
        match part {
            ClipChoice::Test => ["evaluation.json", "evaluation_data.json"],
            ClipChoice::Validation => [
                "evaluation_validation.json",
                "evaluation_validation_data.json",
            ],
            ClipChoice::Train => ["evaluation_train.json", "evaluation_train_data.json"],
        }
    }

    /// Writes the scores as JSON, which says on which clips unless on the test clips.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_scores(&self, path: &Path) -> anyhow::Result<()> {
        let scores = Scores {
            clips: self.data.part,
            evaluation: &self.evaluation,
        };
        write_json(path, &scores)
    }

    /// Whether a folder has scores on the test clips, sound or not.
    pub fn is_in(folder: &Path) -> bool {
        let [scores, _] = Self::files(ClipChoice::Test);
        folder.join(scores).exists()
    }

    /// Writes both files into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let [scores, data] = Self::files(self.data.part);
        write_json(&folder.join(data), &self.data)?;
        self.write_scores(&folder.join(scores))
    }

    /// Reads what [`EvaluationRecord::write`] wrote of the test clips.
    ///
    /// # Errors
    /// The folder has no such scores (the error says how to get them), or a file is damaged.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let [scores, data] = Self::files(ClipChoice::Test);
        let record = Self {
            evaluation: read_json(folder, scores)?,
            data: read_json(folder, data)?,
        };
        if !record.data.part.is_test() {
            anyhow::bail!(
                "{} are scores on {} clips, not on the test clips; to get those, {}",
                folder.join(scores).display(),
                record.data.part,
                remedy(folder)
            );
        }
        Ok(record)
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
    if !path.exists() {
        anyhow::bail!(
            "{} has no {name}; to get one, {}",
            folder.display(),
            remedy(folder)
        );
    }
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("{} cannot be read", path.display()))?;
    serde_json::from_str(&text).with_context(|| {
        format!(
            "{} holds no scores on test clips; to get some, {}",
            path.display(),
            remedy(folder)
        )
    })
}

/// How a folder gets scores on the test clips.
fn remedy(folder: &Path) -> String {
    format!(
        "run `keydance evaluate {} --data DIR` (a config: `keydance evaluate CONFIG --data DIR --out {}`)",
        folder.display(),
        folder.display()
    )
}

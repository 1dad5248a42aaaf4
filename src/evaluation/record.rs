//! A model's scores in a folder: `evaluation.json`, and `evaluation_data.json` that says on what
//! they were measured. Scores on other clips than the test clips have files of their own, such as
//! `evaluation_validation.json`.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::ProtocolScores;
use crate::counted::counted;
use crate::data::{DataPart, Dataset, EmptyPart, Recording};
use crate::report::thousands;
use crate::run::{FileError, RunFolder, write_json};

/// Why a folder's scores cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// There are none, or others: how to get some.
    #[error("{0}")]
    Refused(String),
    #[error(transparent)]
    File(#[from] FileError),
}

/// What a model was evaluated on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EvaluatedData {
    /// Which part of the data set.
    #[serde(default)]
    pub part: DataPart,
    #[serde(alias = "test_clips")]
    pub clips: usize,
    #[serde(alias = "test_frames")]
    pub frames: usize,
    /// At most so many windows of each length were scored, where that left some out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub most_windows: Option<usize>,
    /// Digest of the whole data set, see [`Dataset::digest`].
    pub data_digest: String,
    /// SHA-256 of the file of the weights that were scored; none without one, or where the
    /// version that evaluated did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// Version of keydance that evaluated, and its commit where it was built in a git checkout.
    pub version: String,
    pub commit: Option<String>,
}

impl EvaluatedData {
    /// Of a model with the weights of the file with this digest.
    ///
    /// # Errors
    /// The data set has no such clips.
    pub fn of(
        dataset: &Dataset,
        part: DataPart,
        weights: Option<String>,
    ) -> Result<Self, EmptyPart> {
        let clips = part.of(dataset)?;
        Ok(Self {
            part,
            clips: clips.len(),
            frames: clips.iter().map(Recording::frames).sum(),
            most_windows: None,
            data_digest: dataset.digest.clone(),
            weights,
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("KEYDANCE_COMMIT").map(Into::into),
        })
    }

    /// What the scores were measured on, for a caption.
    pub fn caption(&self) -> String {
        format!(
            "{}{}, {} frames, of the data with digest {}",
            self.windows(),
            counted(self.clips, "test clip"),
            thousands(self.frames as u64),
            self.data_digest
        )
    }

    /// "at most 200 windows of each length of ", where not all were scored.
    pub fn windows(&self) -> String {
        match self.most_windows {
            Some(most) => format!("at most {} of each length of ", counted(most, "window")),
            None => String::new(),
        }
    }
}

/// Scores and what they were measured on.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluationRecord {
    pub scores: ProtocolScores,
    pub data: EvaluatedData,
}

/// The JSON of scores. Those on the test clips are no more than the scores.
#[derive(Serialize)]
struct ScoresFile<'a> {
    #[serde(skip_serializing_if = "DataPart::is_test")]
    clips: DataPart,
    #[serde(flatten)]
    scores: &'a ProtocolScores,
}

impl EvaluationRecord {
    /// Names of the files: scores, and what they were measured on.
    pub fn files(part: DataPart) -> [&'static str; 2] {
        match part {
            DataPart::Test => ["evaluation.json", "evaluation_data.json"],
            DataPart::Validation => [
                "evaluation_validation.json",
                "evaluation_validation_data.json",
            ],
            DataPart::Train => ["evaluation_train.json", "evaluation_train_data.json"],
        }
    }

    /// Writes the scores as JSON, which says on which clips unless on the test clips.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_scores(&self, path: &Path) -> Result<(), FileError> {
        let scores = ScoresFile {
            clips: self.data.part,
            scores: &self.scores,
        };
        write_json(path, &scores)
    }

    /// Whether a folder has scores on the test clips, sound or not.
    pub fn is_in(folder: &Path) -> bool {
        let [scores, _] = Self::files(DataPart::Test);
        folder.join(scores).exists()
    }

    /// Whether a folder has scores on that part of data, but on other clips.
    pub fn is_of_other_clips(folder: &Path, data: &EvaluatedData) -> bool {
        let [_, file] = Self::files(data.part);
        let clips = |data: &EvaluatedData| (data.clips, data.frames, data.data_digest.clone());
        read_json(folder, file).is_ok_and(|theirs: EvaluatedData| clips(&theirs) != clips(data))
    }

    /// Writes both files into a folder that exists.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), FileError> {
        let [scores, data] = Self::files(self.data.part);
        write_json(&folder.join(data), &self.data)?;
        self.write_scores(&folder.join(scores))
    }

    /// Reads what [`EvaluationRecord::write`] wrote of the test clips.
    ///
    /// # Errors
    /// The folder has no such scores (the error says how to get them), or a file is damaged; they
    /// are scores of other weights than the run's in the folder ended with.
    pub fn read(folder: &Path) -> Result<Self, RecordError> {
        let [scores, data] = Self::files(DataPart::Test);
        let record = Self {
            scores: read_json(folder, scores)?,
            data: read_json(folder, data)?,
        };
        if record.scores.most_windows() == 0 {
            return Err(RecordError::Refused(format!(
                "{} holds no scores; to get some, {}",
                folder.join(scores).display(),
                remedy(folder)
            )));
        }
        if !record.data.part.is_test() {
            return Err(RecordError::Refused(format!(
                "{} are scores on {} clips, not on the test clips; to get those, {}",
                folder.join(scores).display(),
                record.data.part,
                remedy(folder)
            )));
        }
        let manifest = RunFolder::open(folder).manifest().ok().flatten();
        let ended = manifest.and_then(|it| it.weights_file_digest);
        match record.data.weights.as_ref().zip(ended) {
            Some((scored, ended)) if *scored != ended => Err(RecordError::Refused(format!(
                "{} are scores of other weights than the training ended with, such as of a \
                 checkpoint; to get those, {}",
                folder.join(scores).display(),
                remedy(folder)
            ))),
            _ => Ok(record),
        }
    }
}

fn read_json<T: DeserializeOwned>(folder: &Path, name: &str) -> Result<T, RecordError> {
    let path = folder.join(name);
    if !path.exists() {
        return Err(RecordError::Refused(format!(
            "{} has no {name}; to get one, {}",
            folder.display(),
            remedy(folder)
        )));
    }
    let text = std::fs::read_to_string(&path).map_err(FileError::at(&path, "read"))?;
    serde_json::from_str(&text).map_err(|cause| {
        RecordError::Refused(format!(
            "{} holds no scores by protocol on test clips; to get some, {}: {cause}",
            path.display(),
            remedy(folder)
        ))
    })
}

/// How a folder gets scores on the test clips.
fn remedy(folder: &Path) -> String {
    let folder = folder.display();
    format!(
        "run `keydance evaluate {folder} --data DIR` (a config: `keydance evaluate CONFIG --data DIR \
         --out {folder}`)"
    )
}

//! Whose clip is whose: what the page does not say.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::{Question, StudyError};
use crate::run::FileError;

/// `key.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyKey {
    /// The study's identity, which its page has as well.
    pub study: String,
    /// What the clips' identities and the orders of the participants follow from.
    pub seed: u64,
    /// Longest clip, s.
    pub seconds: f64,
    /// Left out at the beginning of every dance, s.
    pub skip: f64,
    pub questions: Vec<Question>,
    /// In the order of tables.
    pub models: Vec<StudyModel>,
    /// By their identity.
    pub clips: BTreeMap<String, StudyClip>,
}

/// A model, and the folder that held its dances.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyModel {
    pub name: String,
    pub folder: PathBuf,
}

/// Whose a clip is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StudyClip {
    pub model: String,
    /// Name of the dance's file, which all models have.
    pub stimulus: String,
}

impl StudyKey {
    /// Reads `key.json`.
    ///
    /// # Errors
    /// The file cannot be read, is no key, or has a clip of a model that it does not list.
    pub fn read(file: &Path) -> Result<Self, StudyError> {
        let text = fs::read(file).map_err(FileError::at(file, "read"))?;
        let key: Self = serde_json::from_slice(&text).map_err(|source| StudyError::Key {
            file: file.into(),
            source,
        })?;
        let is_listed = |clip: &StudyClip| key.models.iter().any(|it| it.name == clip.model);
        match key.clips.iter().find(|(_, clip)| !is_listed(clip)) {
            None => Ok(key),
            Some((clip, StudyClip { model, .. })) => Err(StudyError::Refused(format!(
                "{}: clip {clip} is of {model:?}, which is none of its models; make the study's \
                 page and key again",
                file.display()
            ))),
        }
    }
}

/// `NAME=FOLDER`.
impl std::str::FromStr for StudyModel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        match text.split_once('=') {
            Some((name, folder)) if !name.trim().is_empty() && !folder.is_empty() => Ok(Self {
                name: name.trim().into(),
                folder: folder.into(),
            }),
            _ => Err("expected NAME=FOLDER, such as interpolation=dances/interpolation".into()),
        }
    }
}

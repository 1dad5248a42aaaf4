//! What a prepared set says of itself.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::super::config::DataConfig;
use super::super::dataset::DataError;

/// What stands behind the clips.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Contents {
    pub preparation: Preparation,
    /// By their names, bytewise.
    pub clips: Vec<Entry>,
    /// What was odd about the files, or was changed in reading them.
    pub warnings: Vec<String>,
}

/// A clip of the file.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Entry {
    pub name: String,
    /// SHA-256 of the file that it was made of, hexadecimal.
    pub source_digest: String,
    pub joints: Vec<JointEntry>,
    /// s
    pub frame_time: f64,
    pub frames: u64,
    /// Whether joints other than the root are translated otherwise in some frame than in the first.
    pub translated: bool,
    /// Where its first frame begins, bytes.
    pub place: u64,
    /// SHA-256 of its bytes.
    pub digest: [u8; 32],
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct JointEntry {
    pub name: String,
    pub parent: Option<u64>,
    /// cm
    pub offset: [f64; 3],
    /// cm
    pub end_sites: Vec<[f64; 3]>,
    /// Translation in the first frame, cm.
    pub translation: [f64; 3],
}

/// The keys of `[data]` that poses depend on, with their values, JSON.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Preparation(String);

impl Preparation {
    pub fn of(config: &DataConfig) -> Self {
        let default = DataConfig::default();
        // What splits and measures clips, which is done when they are read.
        let poses = DataConfig {
            contact_threshold: default.contact_threshold,
            facing_sigma: default.facing_sigma,
            split: default.split,
            validation_share: default.validation_share,
            music: default.music,
            motion_beats: default.motion_beats,
            ..config.clone()
        };
        Self(serde_json::to_string(&poses).unwrap_or_default())
    }

    fn keys(&self) -> Map<String, Value> {
        serde_json::from_str(&self.0).unwrap_or_default()
    }

    /// Refuses to take what was prepared so for what is `asked` for.
    ///
    /// # Errors
    /// The first key that differs.
    pub fn check(&self, asked: &Self, path: &Path) -> Result<(), DataError> {
        if self == asked {
            return Ok(());
        }
        let (own, asked) = (self.keys(), asked.keys());
        let mut keys = own.keys().chain(asked.keys());
        let key = keys.find(|key| own.get(*key) != asked.get(*key));
        let key = key.map_or("data", |key| key);
        let said = |keys: &Map<String, Value>| match keys.get(key) {
            None => "(default)".to_string(),
            Some(Value::Object(_)) => "one".to_string(),
            Some(value) => value.to_string(),
        };
        let differ = match (own.get(key), asked.get(key)) {
            (Some(Value::Object(_)), Some(Value::Object(_))) => {
                format!("another data.{key} than the config has")
            }
            _ => format!(
                "data.{key} = {}, and the config has {}",
                said(&own),
                said(&asked)
            ),
        };
        Err(DataError::Prepared {
            path: path.into(),
            problem: format!(
                "it was prepared with {differ}: prepare the folder again with this config"
            ),
        })
    }
}

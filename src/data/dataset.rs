//! A folder of BVH files as training, validation and test clips.

use std::path::Path;

use ndarray::Array2;
use thiserror::Error;

use super::config::DataConfig;
use crate::motion::Clip;

/// A clip on the dance skeleton, with its features.
#[derive(Debug, Clone, PartialEq)]
pub struct DanceClip {
    /// The file's name with its extension.
    pub name: String,
    /// `[frames, 154]`, not standardised, the facing angle unwrapped along the clip.
    pub features: Array2<f64>,
    /// The motion at the config's rate.
    pub clip: Clip,
}

/// A data set, split.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    pub train: Vec<DanceClip>,
    /// Cut from the training clips; empty unless the config asks for it.
    pub validation: Vec<DanceClip>,
    pub test: Vec<DanceClip>,
    /// SHA-256 over the names and bytes of the files, hexadecimal.
    pub digest: String,
}

/// Why a folder is not a data set.
#[derive(Debug, Error)]
pub enum DataError {}

impl Dataset {
    /// Reads all BVH files of a folder and splits them.
    pub fn load(_folder: &Path, _config: &DataConfig) -> Result<Self, DataError> {
        unimplemented!()
    }
}

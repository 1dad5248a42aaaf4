//! A folder of BVH files as training, validation and test clips.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use ndarray::Array2;
use rayon::prelude::*;
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::config::DataConfig;
use super::split::{Parts, check_dance_frames, split};
use crate::motion::bvh::{self, BvhError};
use crate::motion::{Clip, FeatureError, Mapping, MappingError, ResampleError, features, resample};

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
    /// SHA-256 over the files' names and bytes, hexadecimal: what
    /// `LC_ALL=C sha256sum *.bvh | sha256sum` prints in the folder.
    pub digest: String,
}

/// Why a folder is not a data set.
#[derive(Debug, Error)]
pub enum DataError {
    #[error("the data folder {folder} cannot be read")]
    Folder {
        folder: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[error(
        "the data folder {folder} holds no .bvh file; the 123 dance clips are in the repository \
         https://github.com/wslh852/Keyframe-based-Complex-Motion-Synthesis (they come from DanceDB, http://dancedb.eu)"
    )]
    NoClips { folder: PathBuf },
    #[error("{path} cannot be read")]
    File {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// The config and the folder contradict each other.
    #[error("the config says {config}, but the data folder {folder} {found}")]
    Split {
        config: String,
        folder: PathBuf,
        found: String,
    },
    #[error("data.{key} = {value}: expected {expected}")]
    Config {
        key: &'static str,
        value: String,
        expected: &'static str,
    },
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Mapping(#[from] MappingError),
    #[error(transparent)]
    Resample(#[from] ResampleError),
    #[error(transparent)]
    Features(#[from] FeatureError),
}

impl DanceClip {
    /// A clip brought to the config's rate, put on the dance skeleton by `mapping` where there is one, and measured.
    ///
    /// # Errors
    /// The clip cannot be resampled, mapped or measured.
    pub fn new(
        clip: Clip,
        mapping: Option<&Mapping>,
        config: &DataConfig,
    ) -> Result<Self, DataError> {
        let clip = resample(clip, config.fps)?;
        let clip = match mapping {
            Some(mapping) => mapping.apply(&clip)?,
            None => clip,
        };
        Ok(Self {
            name: clip.name.clone(),
            features: features(&clip, &config.features())?,
            clip,
        })
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.features.nrows()
    }
}

impl Dataset {
    /// Reads the BVH files that lie in a folder (not those in folders inside it) and splits them.
    ///
    /// # Errors
    /// The folder has no BVH file, a file is bad, or the config does not fit what is there.
    pub fn load(folder: &Path, config: &DataConfig) -> Result<Self, DataError> {
        let names = clip_names(folder)?;
        let parts = split(&names, folder, config)?;
        let mapping = config.mapping.as_deref().map(Mapping::read).transpose()?;
        let read = |names: &Vec<String>| -> Result<Vec<(DanceClip, String)>, DataError> {
            let clips: Vec<_> = names
                .par_iter()
                .map(|name| read_clip(folder, name, mapping.as_ref(), config))
                .collect();
            clips.into_iter().collect()
        };
        let Parts {
            train,
            validation,
            test,
        } = &parts;
        let (train, validation, test) = (read(train)?, read(validation)?, read(test)?);
        let digest = digest(train.iter().chain(&validation).chain(&test));
        let clips =
            |part: Vec<(DanceClip, String)>| part.into_iter().map(|(clip, _)| clip).collect();
        let dataset = Self {
            train: clips(train),
            validation: clips(validation),
            test: clips(test),
            digest,
        };
        check_dance_frames(&dataset, folder, config)?;
        Ok(dataset)
    }
}

/// Names of the BVH files in a folder, sorted bytewise.
fn clip_names(folder: &Path) -> Result<Vec<String>, DataError> {
    let unreadable = |source| DataError::Folder {
        folder: folder.into(),
        source,
    };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let name = entry
            .map_err(unreadable)?
            .file_name()
            .to_string_lossy()
            .into_owned();
        let is_bvh = Path::new(&name)
            .extension()
            .is_some_and(|end| end.eq_ignore_ascii_case("bvh"));
        if is_bvh && !name.starts_with('.') {
            names.push(name);
        }
    }
    names.sort_unstable();
    if names.is_empty() {
        Err(DataError::NoClips {
            folder: folder.into(),
        })
    } else {
        Ok(names)
    }
}

/// A clip and the SHA-256 of its file.
fn read_clip(
    folder: &Path,
    name: &str,
    mapping: Option<&Mapping>,
    config: &DataConfig,
) -> Result<(DanceClip, String), DataError> {
    let path = folder.join(name);
    let bytes = std::fs::read(&path).map_err(|source| DataError::File {
        path: path.clone(),
        source,
    })?;
    let mut clip = bvh::parse(&bytes, &path.display().to_string())?.to_clip();
    clip.name = name.into();
    Ok((
        DanceClip::new(clip, mapping, config)?,
        hexadecimal(&Sha256::digest(&bytes)),
    ))
}

fn digest<'a>(clips: impl Iterator<Item = &'a (DanceClip, String)>) -> String {
    let mut lines: Vec<(&str, &str)> = clips
        .map(|(clip, digest)| (clip.name.as_str(), digest.as_str()))
        .collect();
    lines.sort_unstable();
    let list: String = lines
        .into_iter()
        .map(|(name, digest)| format!("{digest}  {name}\n"))
        .collect();
    hexadecimal(&Sha256::digest(list.as_bytes()))
}

pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

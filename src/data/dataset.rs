//! Recordings as training, validation and test clips.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::config::DataConfig;
use super::folder::{clip_files, left_out};
use super::reading::{FileReading, grouped};
use super::split::{Parts, check_dance_frames, lafan1_warning, split};
use super::twins::twins;
use crate::motion::bvh::{self, BvhError};
use crate::motion::{Clip, FeatureError, Mapping, MappingError, ResampleError, resample};

/// A recorded dance.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The motion at the config's rate; its name is the file's, with the extension.
    pub clip: Clip,
}

/// A data set, split.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    pub train: Vec<Recording>,
    /// Cut from the training clips; empty unless the config asks for it.
    pub validation: Vec<Recording>,
    pub test: Vec<Recording>,
    /// SHA-256 over the files' names and bytes, hexadecimal: what
    /// `LC_ALL=C sha256sum *.bvh | sha256sum` prints in the folder. Of clips without files, over
    /// names and poses.
    pub digest: String,
    /// What is odd about the files, or was changed in reading them; no error.
    pub warnings: Vec<String>,
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
    #[error(
        "the data folder {folder} holds no .bvh file itself; {clips} lie deeper, the first is {first}: give their folder, or put the files into one"
    )]
    ClipsBelow {
        folder: PathBuf,
        clips: usize,
        first: PathBuf,
    },
    #[error("{path} cannot be read")]
    File {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    /// The config and the clips contradict each other.
    #[error("the config says {config}, but {origin} {found}")]
    Split {
        config: String,
        /// The data folder, or what else the clips come from.
        origin: String,
        found: String,
    },
    #[error("two clips are called {name}; clips are split by their names, so give each its own")]
    SameName { name: String },
    #[error(
        "{train} and {test} are the same motion, one to train on and one to test on; take one of them away"
    )]
    SameMotion { train: String, test: String },
    #[error(
        "data.{key} = {value} and the mapping file {file} declares it, too; keep one of the two"
    )]
    DeclaredTwice {
        key: &'static str,
        value: String,
        file: String,
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

impl Recording {
    /// A clip in cm with Y up, brought to the config's rate and, where there is a mapping, onto its
    /// skeleton.
    ///
    /// # Errors
    /// The clip cannot be resampled or mapped.
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
        Ok(Self { clip })
    }

    /// The file's name with its extension.
    pub fn name(&self) -> &str {
        &self.clip.name
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.clip.poses.len()
    }
}

impl Dataset {
    /// Reads the BVH files that lie in a folder (not those in folders inside it) and splits them.
    ///
    /// # Errors
    /// The folder has no BVH file, a file is bad, or the config does not fit what is there.
    pub fn load(folder: &Path, config: &DataConfig) -> Result<Self, DataError> {
        let files = clip_files(folder)?;
        let names: Vec<String> = files.keys().cloned().collect();
        let origin = format!("the data folder {}", folder.display());
        let mut dataset = Self::assemble(&names, &origin, config, |name, mapping| {
            read_clip(&files[name], name, mapping, config)
        })?;
        dataset.warnings.extend(twins(&dataset)?);
        dataset.warnings.extend(left_out(folder));
        Ok(dataset)
    }

    /// The [digest](Dataset::digest) of all clips in a folder; none where they cannot be read.
    pub fn digest_of(folder: &Path) -> Option<String> {
        let read = |(name, path)| Some((name, file_digest(&std::fs::read(path).ok()?)));
        let clips = clip_files(folder).ok()?.into_iter().map(read);
        let clips: Vec<(String, String)> = clips.collect::<Option<_>>()?;
        Some(digest(
            clips.iter().map(|(name, digest)| (&**name, &**digest)),
        ))
    }

    /// Splits clips that are in memory, such as generated ones, by their names: by the same rule as
    /// files.
    ///
    /// # Errors
    /// Two clips of one name, a clip that cannot be measured, or a config that does not fit the
    /// clips.
    pub fn from_clips(clips: Vec<Clip>, config: &DataConfig) -> Result<Self, DataError> {
        let mut by_name = BTreeMap::new();
        for clip in clips {
            if let Some(clip) = by_name.insert(clip.name.clone(), clip) {
                return Err(DataError::SameName { name: clip.name });
            }
        }
        let names: Vec<String> = by_name.keys().cloned().collect();
        Self::assemble(&names, "the set of clips", config, |name, mapping| {
            let clip = &by_name[name];
            Ok(ReadClip {
                recording: Recording::new(clip.clone(), mapping, config)?,
                digest: pose_digest(clip),
                notices: Vec::new(),
            })
        })
    }

    /// The parts of the split, each clip with the digest of what it was made from as `read` gives
    /// them.
    fn assemble(
        names: &[String],
        origin: &str,
        config: &DataConfig,
        read: impl Fn(&String, Option<&Mapping>) -> Result<ReadClip, DataError> + Sync,
    ) -> Result<Self, DataError> {
        let parts = split(names, origin, config)?;
        let read = |names: &Vec<String>| -> Result<Vec<ReadClip>, DataError> {
            let clips: Vec<_> = names
                .par_iter()
                .map(|name| read(name, config.mapping.as_ref()))
                .collect();
            clips.into_iter().collect()
        };
        let Parts {
            train,
            validation,
            test,
        } = &parts;
        let (train, validation, test) = (read(train)?, read(validation)?, read(test)?);
        let all = || train.iter().chain(&validation).chain(&test);
        let digest = digest(all().map(|clip| (clip.recording.name(), &*clip.digest)));
        let warnings = grouped(all().map(|clip| (clip.recording.name(), &clip.notices[..])));
        let clips = |part: Vec<ReadClip>| part.into_iter().map(|clip| clip.recording).collect();
        let mut dataset = Self {
            train: clips(train),
            validation: clips(validation),
            test: clips(test),
            digest,
            warnings,
        };
        check_dance_frames(&dataset, origin, config)?;
        dataset.warnings.extend(lafan1_warning(&dataset, config));
        Ok(dataset)
    }
}

/// A clip that was read.
struct ReadClip {
    recording: Recording,
    /// SHA-256 of what it was made from, hexadecimal.
    digest: String,
    notices: Vec<String>,
}

/// Reads a file; `name` is the clip's.
fn read_clip(
    path: &Path,
    name: &str,
    mapping: Option<&Mapping>,
    config: &DataConfig,
) -> Result<ReadClip, DataError> {
    let bytes = std::fs::read(path).map_err(|source| DataError::File {
        path: path.into(),
        source,
    })?;
    let mut clip = bvh::parse(&bytes, &path.display().to_string())?.to_clip();
    clip.name = name.into();
    let FileReading { recording, notices } = FileReading::of(clip, mapping, config)?;
    Ok(ReadClip {
        recording,
        digest: file_digest(&bytes),
        notices,
    })
}

/// SHA-256 over rate and poses, hexadecimal.
fn pose_digest(clip: &Clip) -> String {
    let mut hash = Sha256::new();
    hash.update(clip.frame_time.to_le_bytes());
    for pose in &clip.poses {
        let numbers = pose.translations.iter().flat_map(|x| x.to_array());
        let numbers = numbers.chain(pose.rotations.iter().flat_map(|x| x.to_array()));
        for number in numbers {
            hash.update(number.to_le_bytes());
        }
    }
    hexadecimal(&hash.finalize())
}

/// SHA-256 over clips by their names and digests, hexadecimal.
fn digest<'a>(clips: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let mut lines: Vec<(&str, &str)> = clips.collect();
    lines.sort_unstable();
    let list: String = lines
        .into_iter()
        .map(|(name, digest)| format!("{digest}  {name}\n"))
        .collect();
    hexadecimal(&Sha256::digest(list.as_bytes()))
}

/// SHA-256 of a file's content, hexadecimal.
pub(crate) fn file_digest(content: &[u8]) -> String {
    hexadecimal(&Sha256::digest(content))
}

pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        // Writing to a String cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

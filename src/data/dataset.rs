//! Recordings as training, validation and test clips.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};
#[cfg(feature = "music")]
use std::sync::Arc;

use rayon::prelude::*;
use sha2::{Digest, Sha256};
use thiserror::Error;

use super::config::{DataConfig, Split};
use super::folder::{clip_files, left_out};
#[cfg(feature = "music")]
use super::given_music::GivenMusic;
use super::listed;
use super::mixed;
#[cfg(feature = "papers")]
use super::motorica::load as motorica;
#[cfg(feature = "music")]
use super::pairs;
use super::part::DataPart;
use super::prepared::{self, Stored, StoredClip};
use super::reading::{FileReading, grouped};
use super::source::ClipSource;
use super::split::{Parts, check_dance_frames, check_frames, lafan1_warning, split};
use super::twins::twins;
use crate::motion::bvh::{self, BvhError};
use crate::motion::{Clip, FeatureError, Mapping, MappingError, ResampleError, resample};
#[cfg(feature = "music")]
use crate::music::{Analysis, Cache, FRAME_RATE};

/// A recorded dance.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The motion at the config's rate; its name is the file's, with the extension.
    pub clip: Clip,
    /// What is heard in its music, from frame 0 of the motion on.
    #[cfg(feature = "music")]
    pub music: Option<Arc<Analysis>>,
    /// What its data set says of its music where there is no sound.
    #[cfg(feature = "music")]
    pub given_music: Option<Arc<GivenMusic>>,
}

/// Frames of clips by the clip: each range from its first frame up to the one after its last.
pub type NamedFrames = BTreeMap<String, Vec<Range<usize>>>;

/// A data set, split.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Dataset {
    pub train: Vec<Recording>,
    /// Clips that stay in a prepared set, in place of `train` and `test`.
    pub stored: Stored,
    /// Cut from the training clips; empty unless the config asks for it.
    pub validation: Vec<Recording>,
    pub test: Vec<Recording>,
    /// SHA-256 over the files' names and bytes, hexadecimal: what
    /// `LC_ALL=C sha256sum *.bvh | sha256sum` prints in the folder; where clips have music, of each
    /// clip and its sound file together. Of clips without files, over names and poses.
    pub digest: String,
    /// Frames of clips by a name of theirs, such as those of new poses.
    pub named_frames: BTreeMap<String, NamedFrames>,
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
    #[error("{first} and {second} are music of one name; keep one of them")]
    TwoSounds { first: PathBuf, second: PathBuf },
    #[error(
        "{dance} has no music: data.music = true asks for a sound file of its name (wav, flac, mp3 \
         or ogg) beside it or in the folder audio"
    )]
    NoSound { dance: String },
    #[error(
        "{dance} has {frames} and its music {sound} only {heard} (at 30 a second); cut the dance, or \
         give the whole music"
    )]
    ShortMusic {
        dance: String,
        frames: String,
        sound: PathBuf,
        heard: String,
    },
    #[error("data.music = true: this build hears nothing; build with the feature music")]
    Deaf,
    #[error("split = \"motorica\": this build does not read it; build with the feature papers")]
    Unread,
    #[error("{path} is not what it should be: {problem}")]
    Listed { path: PathBuf, problem: String },
    #[error("{path} cannot be taken for data: {problem}")]
    Prepared { path: PathBuf, problem: String },
    #[error("{path} cannot be written")]
    Written {
        path: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[error(
        "what is kept of every frame while a model trains does not fit into {folder}: point TMPDIR \
         to a folder with more room"
    )]
    Scratch {
        folder: PathBuf,
        #[source]
        source: std::io::Error,
    },
    #[cfg(feature = "music")]
    #[error(transparent)]
    Music(#[from] crate::music::MusicError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error(transparent)]
    Mapping(#[from] MappingError),
    #[error(transparent)]
    Resample(#[from] ResampleError),
    #[error(transparent)]
    Features(#[from] FeatureError),
}

/// Whether data is a file, as prepared sets are.
fn is_set(path: &Path) -> Result<bool, DataError> {
    // Another error names the folder that is not there.
    let Ok(metadata) = path.metadata() else {
        return Ok(false);
    };
    match metadata.is_dir() || metadata.is_file() {
        true => Ok(metadata.is_file()),
        false => Err(DataError::Prepared {
            path: path.into(),
            problem: "it is a pipe or a device: give a folder of BVH files, or the file that \
                      keydance prepare wrote"
                .into(),
        }),
    }
}

impl Recording {
    /// A clip at the config's rate, without music.
    pub fn of(clip: Clip) -> Self {
        Self {
            clip,
            #[cfg(feature = "music")]
            music: None,
            #[cfg(feature = "music")]
            given_music: None,
        }
    }

    /// When its music has beats, s from frame 0 on, ascending; none where nothing is known of it.
    #[cfg(feature = "music")]
    pub fn beat_times(&self) -> Vec<f64> {
        match (&self.music, &self.given_music) {
            (Some(music), _) => {
                let beats = music.beats.iter();
                beats.map(|&frame| frame as f64 / FRAME_RATE).collect()
            }
            (None, Some(given)) => given.beats.clone(),
            (None, None) => Vec::new(),
        }
    }

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
        Ok(Self::of(clip))
    }

    /// The file's name with its extension.
    pub fn name(&self) -> &str {
        &self.clip.name
    }

    /// Its motion, to train on.
    pub fn source(&self) -> ClipSource<'_> {
        ClipSource::Held(Cow::Borrowed(&self.clip))
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.clip.poses.len()
    }
}

impl Dataset {
    /// Reads the BVH files that lie in a folder (not those in folders inside it), or a prepared set
    /// of them, and splits them.
    ///
    /// # Errors
    /// The folder has no BVH file, a file is bad, or the config does not fit what is there.
    pub fn load(folder: &Path, config: &DataConfig) -> Result<Self, DataError> {
        if is_set(folder)? {
            return prepared::load(folder, config, false);
        }
        match config.split {
            Split::Motorica => return motorica(folder, config),
            Split::Mixed => return mixed::load(folder, config),
            _ => {}
        }
        let files = clip_files(folder)?;
        let names: Vec<String> = files.keys().cloned().collect();
        let origin = format!("the data folder {}", folder.display());
        let listed = match config.split {
            Split::MusicDance => Some(listed::parts(folder)?),
            _ => None,
        };
        let hear = hearing(folder, config)?;
        let mut dataset = Self::assemble(&names, &origin, config, listed, |name, mapping| {
            hear(read_clip(&files[name], name, mapping, config)?)
        })?;
        dataset.named_frames = listed::named_frames(folder, config.fps)?;
        dataset.warnings.extend(dataset.twins()?);
        dataset.warnings.extend(left_out(folder));
        Ok(dataset)
    }

    /// The same to train on alone: of a prepared set the training clips stay in the file.
    ///
    /// # Errors
    /// As [`Dataset::load`].
    pub fn load_to_train(path: &Path, config: &DataConfig) -> Result<Self, DataError> {
        match is_set(path)? {
            true => prepared::load(path, config, true),
            false => Self::load(path, config),
        }
    }

    /// Clips and frames of a part, wherever they are.
    pub fn size(&self, part: DataPart) -> (usize, usize) {
        let (held, stored) = match part {
            DataPart::Train => (&self.train, &self.stored.train[..]),
            DataPart::Validation => (&self.validation, &[][..]),
            DataPart::Test => (&self.test, &self.stored.test[..]),
        };
        let frames = held.iter().map(Recording::frames);
        let frames = frames.chain(stored.iter().map(StoredClip::frames));
        (held.len() + stored.len(), frames.sum())
    }

    /// The clips to train on, wherever they are.
    pub fn training_clips(&self) -> Vec<ClipSource<'_>> {
        let held = self.train.iter().map(Recording::source);
        held.chain(self.stored.train.iter().map(ClipSource::Stored))
            .collect()
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
        Self::assemble(&names, "the set of clips", config, None, |name, mapping| {
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
    pub(super) fn assemble(
        names: &[String],
        origin: &str,
        config: &DataConfig,
        listed: Option<Parts>,
        read: impl Fn(&String, Option<&Mapping>) -> Result<ReadClip, DataError> + Sync,
    ) -> Result<Self, DataError> {
        let parts = match listed {
            Some(parts) => listed::among(parts, names, origin)?,
            None => split(names, origin, config)?,
        };
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
        let dataset = Self {
            train: clips(train),
            validation: clips(validation),
            test: clips(test),
            digest,
            warnings,
            ..Self::default()
        };
        dataset.with_sizes_checked(origin, config)
    }

    /// Checked where the config's split says how large its parts are.
    fn with_sizes_checked(mut self, origin: &str, config: &DataConfig) -> Result<Self, DataError> {
        check_frames(&self, origin, config)?;
        check_dance_frames(&self, origin, config)?;
        self.warnings.extend(lafan1_warning(&self, config));
        Ok(self)
    }

    /// The same of clips that lie in a prepared set, to train on: the training clips stay there,
    /// the validation clips are read, those that test only counted and looked at for twins.
    pub(super) fn assemble_stored(
        clips: &BTreeMap<String, StoredClip>,
        origin: &str,
        config: &DataConfig,
    ) -> Result<Self, DataError> {
        let names: Vec<String> = clips.keys().cloned().collect();
        let parts = split(&names, origin, config)?;
        let of = |names: &Vec<String>| -> Vec<StoredClip> {
            names.iter().map(|name| clips[name].clone()).collect()
        };
        let [train, validation, test] = [&parts.train, &parts.validation, &parts.test].map(of);
        let known = train.iter().chain(&validation).map(ClipSource::Stored);
        let warnings = twins(known, test.iter().map(ClipSource::Stored))?;
        let all = || train.iter().chain(&validation).chain(&test);
        let digest = digest(all().map(|clip| (clip.name(), clip.source_digest())));
        let validation = validation.iter().map(|it| Ok(Recording::of(it.whole()?)));
        let dataset = Self {
            validation: validation.collect::<Result<_, DataError>>()?,
            stored: Stored { train, test },
            digest,
            warnings,
            ..Self::default()
        };
        dataset.with_sizes_checked(origin, config)
    }

    /// Warnings about clips that are the same motion, see [`twins`].
    pub(super) fn twins(&self) -> Result<Vec<String>, DataError> {
        let known = self.train.iter().chain(&self.validation);
        twins(
            known.map(Recording::source),
            self.test.iter().map(Recording::source),
        )
    }
}

#[cfg(not(feature = "papers"))]
fn motorica(_folder: &Path, _config: &DataConfig) -> Result<Dataset, DataError> {
    Err(DataError::Unread)
}

/// What gives a clip that was read its music, where the config asks for it.
#[cfg(feature = "music")]
fn hearing(
    folder: &Path,
    config: &DataConfig,
) -> Result<impl Fn(ReadClip) -> Result<ReadClip, DataError> + Sync, DataError> {
    let cache = Cache::of_user();
    let sounds = config
        .music
        .then(|| pairs::sound_files(folder))
        .transpose()?;
    Ok(move |mut clip: ReadClip| {
        let Some(sounds) = &sounds else {
            return Ok(clip);
        };
        let name = clip.recording.name();
        let no_sound = || DataError::NoSound { dance: name.into() };
        let sound = pairs::sound_of(name, sounds).ok_or_else(no_sound)?;
        let bytes = std::fs::read(sound).map_err(|source| DataError::File {
            path: sound.clone(),
            source,
        })?;
        clip.digest = file_digest(format!("{} {}", clip.digest, file_digest(&bytes)).as_bytes());
        let (recording, notices) = pairs::with_music(clip.recording, sound, &cache)?;
        clip.notices.extend(notices);
        Ok(ReadClip { recording, ..clip })
    })
}

#[cfg(not(feature = "music"))]
fn hearing(
    _folder: &Path,
    config: &DataConfig,
) -> Result<impl Fn(ReadClip) -> Result<ReadClip, DataError> + Sync, DataError> {
    match config.music {
        true => Err(DataError::Deaf),
        false => Ok(Ok),
    }
}

/// A clip that was read.
pub(super) struct ReadClip {
    pub recording: Recording,
    /// SHA-256 of what it was made from, hexadecimal.
    pub digest: String,
    pub notices: Vec<String>,
}

/// Reads a file; `name` is the clip's.
pub(super) fn read_clip(
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
    let FileReading {
        recording, notices, ..
    } = FileReading::of(clip, mapping, config)?;
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
pub(super) fn digest<'a>(clips: impl Iterator<Item = (&'a str, &'a str)>) -> String {
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

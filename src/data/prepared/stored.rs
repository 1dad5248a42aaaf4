//! Clips of a prepared set.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use bincode::config::{Configuration, Limit, LittleEndian, Varint};
use glam::{DQuat, DVec3};
use sha2::{Digest as _, Sha256};

use super::super::dataset::DataError;
use super::contents::{Contents, Entry};
use super::{END, MAGIC, VERSION};
use crate::motion::{Clip, Joint, Pose, Skeleton};

/// Most bytes that contents may take: those of a million clips.
const LARGEST: usize = 1 << 32;
const NUMBER: usize = size_of::<f64>();

const FORMAT: Configuration<LittleEndian, Varint, Limit<LARGEST>> =
    bincode::config::standard().with_limit::<LARGEST>();

/// A prepared set that is open.
#[derive(Debug)]
pub(super) struct PreparedFile {
    path: PathBuf,
    file: Mutex<File>,
    /// Its length and when it was written, as it was opened.
    state: (u64, Option<SystemTime>),
}

/// Length of a file, and when it was last written to.
fn state(file: &File) -> io::Result<(u64, Option<SystemTime>)> {
    let metadata = file.metadata()?;
    Ok((metadata.len(), metadata.modified().ok()))
}

impl PreparedFile {
    pub fn open(path: &Path) -> Result<Self, DataError> {
        let unreadable = |source| DataError::File {
            path: path.into(),
            source,
        };
        let file = File::open(path).map_err(unreadable)?;
        Ok(Self {
            path: path.into(),
            state: state(&file).map_err(unreadable)?,
            file: Mutex::new(file),
        })
    }

    fn problem(&self, problem: impl Into<String>) -> DataError {
        DataError::Prepared {
            path: self.path.clone(),
            problem: problem.into(),
        }
    }

    fn bytes(&self, place: u64, count: usize) -> Result<Vec<u8>, DataError> {
        let read = || -> io::Result<Option<Vec<u8>>> {
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            if state(&file)? != self.state {
                return Ok(None);
            }
            file.seek(SeekFrom::Start(place))?;
            let mut bytes = vec![0; count];
            file.read_exact(&mut bytes)?;
            Ok(Some(bytes))
        };
        match read() {
            Ok(Some(bytes)) => Ok(bytes),
            Ok(None) => Err(self.problem("it was written to since it was opened: begin again")),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                Err(self.problem("it ends too early"))
            }
            Err(source) => Err(DataError::File {
                path: self.path.clone(),
                source,
            }),
        }
    }

    pub fn contents(&self) -> Result<Contents, DataError> {
        let (length, _) = self.state;
        let none = || {
            self.problem(
                "it is no prepared set: give a folder of BVH files, or what keydance prepare wrote",
            )
        };
        let head = MAGIC.len() + size_of::<u32>();
        if length < (head + END) as u64 {
            return Err(none());
        }
        let start = self.bytes(0, head)?;
        let version = start.strip_prefix(MAGIC).ok_or_else(none)?;
        if version != VERSION.to_le_bytes() {
            return Err(self.problem("another version of keydance prepared it: prepare it again"));
        }
        let damaged = || self.problem("it is damaged: prepare it again");
        let end = self.bytes(length - END as u64, END)?;
        let (digest, place) = end.split_last_chunk().ok_or_else(damaged)?;
        let place = u64::from_le_bytes(*place);
        let count = (length - END as u64).checked_sub(place);
        let count = count.and_then(|it| usize::try_from(it).ok());
        let bytes = self.bytes(
            place,
            count.filter(|&it| it <= LARGEST).ok_or_else(damaged)?,
        )?;
        if Sha256::digest(&bytes).as_slice() != digest {
            return Err(damaged());
        }
        let decoded = bincode::serde::decode_from_slice(&bytes, FORMAT);
        decoded.map(|(contents, _)| contents).map_err(|_| damaged())
    }
}

/// What stands behind the clips, in bytes.
pub(super) fn encoded(contents: &Contents) -> io::Result<Vec<u8>> {
    bincode::serde::encode_to_vec(contents, FORMAT).map_err(io::Error::other)
}

/// The clips of a data set that stay in a prepared set; those that test are only counted.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stored {
    pub train: Vec<StoredClip>,
    pub test: Vec<StoredClip>,
}

/// A clip whose poses stay in a prepared set.
#[derive(Debug, Clone)]
pub struct StoredClip {
    name: String,
    source_digest: String,
    skeleton: Skeleton,
    /// Of all joints in the first frame, cm.
    translations: Vec<DVec3>,
    frame_time: f64,
    frames: usize,
    translated: bool,
    place: u64,
    digest: [u8; 32],
    file: Arc<PreparedFile>,
}

/// Of the same name and frames.
impl PartialEq for StoredClip {
    fn eq(&self, other: &Self) -> bool {
        let own = |it: &Self| (it.name.clone(), it.frames, it.digest);
        own(self) == own(other)
    }
}

/// The clip of an entry.
pub(super) fn stored(entry: Entry, file: &Arc<PreparedFile>) -> Result<StoredClip, DataError> {
    let joint = |joint: &super::contents::JointEntry| Joint {
        name: joint.name.clone(),
        parent: joint.parent.map(|parent| parent as usize),
        offset: joint.offset.into(),
        end_sites: joint.end_sites.iter().map(|&site| site.into()).collect(),
    };
    let clip = StoredClip {
        skeleton: Skeleton {
            joints: entry.joints.iter().map(joint).collect(),
        },
        translations: entry
            .joints
            .iter()
            .map(|it| it.translation.into())
            .collect(),
        name: entry.name,
        source_digest: entry.source_digest,
        frame_time: entry.frame_time,
        frames: entry.frames as usize,
        translated: entry.translated,
        place: entry.place,
        digest: entry.digest,
        file: file.clone(),
    };
    let parents = clip.skeleton.joints.iter().enumerate();
    let mut earlier = parents.map(|(at, joint)| joint.parent.is_none_or(|parent| parent < at));
    match !clip.skeleton.joints.is_empty() && earlier.all(|it| it) {
        true => Ok(clip),
        false => Err(file.problem("it is damaged: prepare it again")),
    }
}

impl StoredClip {
    /// The file's name with its extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Seconds from one frame to the next.
    pub fn frame_time(&self) -> f64 {
        self.frame_time
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// SHA-256 of the BVH file that it was made of, hexadecimal.
    pub fn source_digest(&self) -> &str {
        &self.source_digest
    }

    fn frame_bytes(&self) -> usize {
        frame_numbers(self.skeleton.len(), self.translated) * NUMBER
    }

    fn bytes(&self, frames: Range<usize>) -> Result<Vec<u8>, DataError> {
        let size = self.frame_bytes();
        let place = self.place + (frames.start * size) as u64;
        self.file.bytes(place, frames.len() * size)
    }

    fn decoded(&self, bytes: &[u8]) -> Vec<Pose> {
        let frames = bytes.chunks_exact(self.frame_bytes());
        frames.map(|bytes| self.pose(bytes)).collect()
    }

    fn pose(&self, bytes: &[u8]) -> Pose {
        let numbers = bytes.as_chunks::<NUMBER>().0;
        let numbers: Vec<f64> = numbers.iter().map(|it| f64::from_le_bytes(*it)).collect();
        let stored = match self.translated {
            true => self.skeleton.len(),
            false => 1,
        };
        let (own, rotations) = numbers.split_at(3 * stored);
        let mut translations = self.translations.clone();
        for (translation, own) in translations.iter_mut().zip(own.as_chunks::<3>().0) {
            *translation = DVec3::from_array(*own);
        }
        let rotations = rotations.as_chunks::<4>().0.iter();
        Pose {
            translations,
            rotations: rotations.map(|it| DQuat::from_array(*it)).collect(),
        }
    }

    /// The poses of these frames.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn poses(&self, frames: Range<usize>) -> Result<Vec<Pose>, DataError> {
        Ok(self.decoded(&self.bytes(frames)?))
    }

    /// The clip in memory.
    ///
    /// # Errors
    /// The file cannot be read, or this part of it is not what was written.
    pub fn whole(&self) -> Result<Clip, DataError> {
        let bytes = self.bytes(0..self.frames)?;
        if Sha256::digest(&bytes).as_slice() != self.digest {
            let problem = format!("{} in it is damaged: prepare it again", self.name);
            return Err(self.file.problem(problem));
        }
        Ok(Clip {
            name: self.name.clone(),
            skeleton: self.skeleton.clone(),
            frame_time: self.frame_time,
            poses: self.decoded(&bytes),
        })
    }
}

/// Numbers of a frame.
fn frame_numbers(joints: usize, translated: bool) -> usize {
    4 * joints + if translated { 3 * joints } else { 3 }
}

/// A clip's frames in bytes, and whether joints other than the root are translated in them.
pub(super) fn frames_in_bytes(clip: &Clip) -> (Vec<u8>, bool) {
    let bones = |pose: &Pose| pose.translations.get(1..).unwrap_or_default().to_vec();
    let first = clip.poses.first().map(bones);
    let translated = clip.poses.iter().any(|pose| Some(bones(pose)) != first);
    let stored = if translated { clip.skeleton.len() } else { 1 };
    let size = frame_numbers(clip.skeleton.len(), translated) * NUMBER;
    let mut bytes = Vec::with_capacity(clip.poses.len() * size);
    for pose in &clip.poses {
        let translations = pose.translations.iter().take(stored);
        let rotations = pose.rotations.iter().flat_map(|it| it.to_array());
        for number in translations.flat_map(|it| it.to_array()).chain(rotations) {
            bytes.extend(number.to_le_bytes());
        }
    }
    (bytes, translated)
}

//! Writes prepared sets.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::ControlFlow;
use std::path::Path;

use rayon::prelude::*;
use sha2::{Digest as _, Sha256};

use super::contents::{Contents, Entry, JointEntry, Preparation};
use super::stored::{encoded, frames_in_bytes};
use super::{MAGIC, VERSION, check_motions_alone, is_prepared, open};
use crate::data::config::DataConfig;
use crate::data::dataset::{DataError, ReadClip, read_clip};
use crate::data::folder::{clip_files, left_out};
use crate::data::reading::grouped;
use crate::data::source::ClipSource;
use crate::data::twins::twins;
use crate::motion::Clip;
use crate::run::Partial;

/// Clips that are read at a time, for every thread.
const AT_ONCE: usize = 4;

/// What was prepared.
#[derive(Debug, Clone, PartialEq)]
pub struct Prepared {
    pub clips: usize,
    pub frames: usize,
    /// Of the file.
    pub bytes: u64,
    /// What is odd about the files, or was changed in reading them.
    pub warnings: Vec<String>,
}

/// Writes the clips of a folder into one file: read as the config's `[data]` says, split when the
/// file is read. `done` hears how many clips are written, of how many, and may stop it: then the
/// result is none, and no file is left.
///
/// # Errors
/// The folder holds what a prepared set does not, a clip cannot be read, or the file cannot be
/// written; then none is left.
pub fn prepare(
    folder: &Path,
    config: &DataConfig,
    path: &Path,
    done: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<Prepared>, DataError> {
    if is_prepared(folder) {
        return Err(DataError::Prepared {
            path: folder.into(),
            problem: "it is prepared already, and prepare takes a folder of BVH files".into(),
        });
    }
    let advice = "with data.split = { share = 0.8 } and without music its motions can be prepared";
    check_motions_alone(config, folder, advice)?;
    let files = clip_files(folder)?;
    let unwritable = |source| DataError::Written {
        path: path.into(),
        source,
    };
    let (partial, file) = Partial::of(path).map_err(unwritable)?;
    let mut writing = Writing::begin(file).map_err(unwritable)?;
    let paths: Vec<_> = files.iter().collect();
    for paths in paths.chunks(AT_ONCE * rayon::current_num_threads()) {
        let read = paths
            .par_iter()
            .map(|(name, path)| read_clip(path, name, config.mapping.as_ref(), config));
        let clips: Vec<_> = read.collect();
        for clip in clips {
            writing.clip(clip?).map_err(unwritable)?;
        }
        if done(writing.entries.len(), files.len()).is_break() {
            return Ok(None);
        }
    }
    let mut warnings = writing.notices();
    warnings.extend(left_out(folder));
    let prepared = writing.end(Preparation::of(config), warnings);
    let mut prepared = prepared.map_err(unwritable)?;
    let (_, clips) = open(partial.path())?;
    let twins = twins(clips.values().map(ClipSource::Stored), [])?;
    prepared.warnings.extend(twins);
    partial.become_whole(path).map_err(unwritable)?;
    Ok(Some(prepared))
}

/// A prepared set that is being written.
struct Writing {
    file: BufWriter<File>,
    place: u64,
    frames: usize,
    entries: Vec<Entry>,
    notices: BTreeMap<String, Vec<String>>,
}

impl Writing {
    fn begin(file: File) -> io::Result<Self> {
        let mut writing = Self {
            file: BufWriter::new(file),
            place: 0,
            frames: 0,
            entries: Vec::new(),
            notices: BTreeMap::new(),
        };
        writing.write(MAGIC)?;
        writing.write(&VERSION.to_le_bytes())?;
        Ok(writing)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.place += bytes.len() as u64;
        self.file.write_all(bytes)
    }

    fn clip(&mut self, read: ReadClip) -> io::Result<()> {
        let clip = read.recording.clip;
        let (bytes, translated) = frames_in_bytes(&clip);
        let place = self.place;
        self.write(&bytes)?;
        self.frames += clip.poses.len();
        self.entries.push(Entry {
            source_digest: read.digest,
            joints: joints(&clip),
            frame_time: clip.frame_time,
            frames: clip.poses.len() as u64,
            translated,
            place,
            digest: Sha256::digest(&bytes).into(),
            name: clip.name.clone(),
        });
        self.notices.insert(clip.name, read.notices);
        Ok(())
    }

    fn notices(&self) -> Vec<String> {
        grouped(self.notices.iter().map(|(name, it)| (&**name, &it[..])))
    }

    fn end(mut self, preparation: Preparation, warnings: Vec<String>) -> io::Result<Prepared> {
        let prepared = Prepared {
            clips: self.entries.len(),
            frames: self.frames,
            bytes: 0,
            warnings: warnings.clone(),
        };
        let contents = encoded(&Contents {
            preparation,
            clips: std::mem::take(&mut self.entries),
            warnings,
        })?;
        let place = self.place;
        self.write(&contents)?;
        self.write(&Sha256::digest(&contents))?;
        self.write(&place.to_le_bytes())?;
        self.file.flush()?;
        self.file.get_ref().sync_all()?;
        Ok(Prepared {
            bytes: self.place,
            ..prepared
        })
    }
}

fn joints(clip: &Clip) -> Vec<JointEntry> {
    let first = clip.poses.first();
    let joints = clip.skeleton.joints.iter().enumerate();
    joints
        .map(|(at, joint)| JointEntry {
            name: joint.name.clone(),
            parent: joint.parent.map(|parent| parent as u64),
            offset: joint.offset.to_array(),
            end_sites: joint.end_sites.iter().map(|it| it.to_array()).collect(),
            translation: first
                .map_or(joint.offset, |pose| pose.translations[at])
                .to_array(),
        })
        .collect()
}

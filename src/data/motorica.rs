//! The Motorica subset: street dances as 61 columns of motion and 29 of music at 20 frames a
//! second, cut into the pieces of its split (spec, section 1; the folder's README).

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DQuat;
use ndarray::{Array2, ArrayView2, s};
use ndarray_npy::ViewNpyExt as _;
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::config::DataConfig;
use super::dataset::{DataError, Dataset, Recording, digest, file_digest};
use super::given_music::GivenMusic;
use super::part::DataPart;
use super::split::check_frames;
use crate::motion::{Clip, GroundPlace, MotionColumns, NamedRotation, Skeleton, bvh};

/// Frames a second of what is read.
pub const FRAME_RATE: f64 = 20.0;
/// Folder of the arrays.
const ARRAYS: &str = "20fps";
/// Names of columns, or what they begin with, that are raw magnitudes.
const MAGNITUDES: [&str; 2] = ["Chroma_", "Spectralflux_"];
/// The column of onset strength.
const ONSET: &str = "Spectralflux_0";

/// The whole folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Motorica {
    /// Of all dancers.
    pub skeleton: Skeleton,
    /// What the columns of motion are.
    pub columns: MotionColumns,
    /// By their names.
    pub dances: BTreeMap<String, MotoricaDance>,
    /// In the order of the split.
    pub pieces: Vec<MotoricaPiece>,
    /// SHA-256 over the names and bytes of the files that were read, hexadecimal.
    pub digest: String,
}

/// A dance from its first frame to its last.
#[derive(Debug, Clone, PartialEq)]
pub struct MotoricaDance {
    /// `[frames, 61]`, cm and rad.
    pub motion: Array2<f64>,
    pub music: GivenMusic,
}

/// Frames of a dance that belong to a part.
#[derive(Debug, Clone, PartialEq)]
pub struct MotoricaPiece {
    pub dance: String,
    pub part: DataPart,
    pub frames: Range<usize>,
}

/// A row of `split.csv`.
#[derive(Deserialize)]
struct SplitRow {
    dance: String,
    part: DataPart,
    first_frame: usize,
    end_frame: usize,
}

/// A row of `beats.csv`.
#[derive(Deserialize)]
struct BeatRow {
    dance: String,
    time_s: f64,
}

/// A row of `features_motion.csv` and `features_audio.csv`.
#[derive(Deserialize)]
struct NameRow {
    name: String,
}

/// The data set of the folder: every piece of the split is a recording, such as
/// `kr_charged@200-1600`, with the music that is given.
///
/// # Errors
/// As [`Motorica::read`]; a config that asks for another rate or for sounds; other numbers of
/// frames than the split has.
pub(super) fn load(folder: &Path, config: &DataConfig) -> Result<Dataset, DataError> {
    let refused = |key, value: String, expected| DataError::Config {
        key,
        value,
        expected,
    };
    if config.fps != FRAME_RATE {
        let expected = "20 with split = \"motorica\"";
        return Err(refused("fps", config.fps.to_string(), expected));
    }
    if config.music {
        let expected = "false with split = \"motorica\", whose music comes as numbers";
        return Err(refused("music", "true".into(), expected));
    }
    let motorica = Motorica::read(folder)?;
    let part = |part: DataPart| -> Result<Vec<Recording>, DataError> {
        let pieces = motorica.pieces.iter().filter(|piece| piece.part == part);
        let recordings = pieces.map(|piece| {
            let Recording {
                clip, given_music, ..
            } = motorica.recording(piece)?;
            let recording = Recording::new(clip, config.mapping.as_ref(), config)?;
            Ok(Recording {
                given_music,
                ..recording
            })
        });
        recordings.collect()
    };
    let dataset = Dataset {
        train: part(DataPart::Train)?,
        validation: part(DataPart::Validation)?,
        test: part(DataPart::Test)?,
        digest: motorica.digest.clone(),
        ..Dataset::default()
    };
    let origin = format!("the data folder {}", folder.display());
    check_frames(&dataset, &origin, config)?;
    Ok(dataset)
}

impl Motorica {
    /// Reads `20fps/*.npy`, `skeleton.bvh`, the names of the columns, beats and split of a folder.
    ///
    /// # Errors
    /// A file is missing, damaged, or does not fit the others: which, and how.
    pub fn read(folder: &Path) -> Result<Self, DataError> {
        let mut files = Files {
            folder,
            digests: BTreeMap::new(),
        };
        let (path, bytes) = files.read("skeleton.bvh")?;
        let document = bvh::parse(&bytes, &path.display().to_string())?;
        let skeleton = document.skeleton().clone();
        let names = files.table::<NameRow>("features_motion.csv")?;
        let columns = columns(&skeleton, &names, &folder.join("features_motion.csv"))?;
        let audio = files.table::<NameRow>("features_audio.csv")?;
        let beats = files.table::<BeatRow>("beats.csv")?;
        let rows = files.table::<SplitRow>("split.csv")?;
        let names: BTreeSet<&String> = rows.iter().map(|row| &row.dance).collect();
        let mut dances = BTreeMap::new();
        for name in names {
            let motion = files.array(&format!("{name}.motion.npy"), None, columns.width())?;
            let frames = Some(motion.nrows());
            let music = files.array(&format!("{name}.audio.npy"), frames, audio.len())?;
            let own = beats.iter().filter(|row| row.dance == *name);
            let music = GivenMusic {
                columns: music,
                magnitudes: magnitudes(&audio),
                onset: onset(&audio, &folder.join("features_audio.csv"))?,
                beats: sorted(own.map(|row| row.time_s), &folder.join("beats.csv"))?,
            };
            let motion = motion.mapv(f64::from);
            dances.insert(name.clone(), MotoricaDance { motion, music });
        }
        let path = folder.join("split.csv");
        let pieces = rows.into_iter().map(|row| piece(row, &dances, &path));
        let pieces = pieces.collect::<Result<_, _>>()?;
        Ok(Self {
            skeleton,
            columns,
            pieces,
            digest: digest(files.digests.iter().map(|(name, it)| (&**name, &**it))),
            dances,
        })
    }

    /// A piece as a recording; it begins at the middle of the floor, with heading 0.
    ///
    /// # Errors
    /// There are no such frames.
    pub fn recording(&self, piece: &MotoricaPiece) -> Result<Recording, DataError> {
        let MotoricaPiece { dance, frames, .. } = piece;
        let name = format!("{dance}@{}-{}", frames.start, frames.end);
        let found = self.dances.get(dance);
        let found = found.filter(|it| frames.start < frames.end && frames.end <= it.motion.nrows());
        let found = found.ok_or_else(|| DataError::Listed {
            path: name.clone().into(),
            problem: "no dance has such frames".into(),
        })?;
        let of_columns = |error: crate::motion::ColumnsError| DataError::Listed {
            path: name.clone().into(),
            problem: error.to_string(),
        };
        let motion = found.motion.slice(s![frames.clone(), ..]);
        let bones = self.skeleton.rest_pose();
        let start = GroundPlace::default();
        let poses = self.columns.poses(motion, &self.skeleton, &bones, start);
        let clip = Clip {
            poses: poses.map_err(of_columns)?,
            name,
            skeleton: self.skeleton.clone(),
            frame_time: 1.0 / FRAME_RATE,
        };
        let seconds = |frame: usize| frame as f64 / FRAME_RATE;
        let inside = seconds(frames.start)..seconds(frames.end);
        let beats = found
            .music
            .beats
            .iter()
            .filter(|beat| inside.contains(beat));
        let music = GivenMusic {
            columns: found.music.columns.slice(s![frames.clone(), ..]).to_owned(),
            beats: beats.map(|beat| beat - inside.start).collect(),
            ..found.music.clone()
        };
        Ok(Recording {
            given_music: Some(Arc::new(music)),
            ..Recording::of(clip)
        })
    }
}

/// The files of the folder, and the digests of those that were read.
struct Files<'f> {
    folder: &'f Path,
    digests: BTreeMap<String, String>,
}

impl Files<'_> {
    fn read(&mut self, name: &str) -> Result<(PathBuf, Vec<u8>), DataError> {
        let path = self.folder.join(name);
        match fs::read(&path) {
            Ok(bytes) => {
                self.digests.insert(name.into(), file_digest(&bytes));
                Ok((path, bytes))
            }
            Err(source) => Err(DataError::File { path, source }),
        }
    }

    /// The rows of a table with a header.
    fn table<T: DeserializeOwned>(&mut self, name: &str) -> Result<Vec<T>, DataError> {
        let (path, bytes) = self.read(name)?;
        let rows = csv::Reader::from_reader(&bytes[..]).into_deserialize();
        let rows: Result<Vec<T>, _> = rows.collect();
        rows.map_err(|error| misfit(&path, error.to_string()))
    }

    /// An array of finite numbers, `[frames, numbers]`.
    fn array(
        &mut self,
        name: &str,
        frames: Option<usize>,
        numbers: usize,
    ) -> Result<Array2<f32>, DataError> {
        let (path, bytes) = self.read(&format!("{ARRAYS}/{name}"))?;
        // A view takes no more memory than the file has, whatever its header says.
        let array = ArrayView2::<f32>::view_npy(&bytes)
            .map_err(|error| misfit(&path, format!("no float32 array of two axes: {error}")))?;
        let expected = frames.unwrap_or(array.nrows());
        if array.dim() != (expected, numbers) {
            let problem = format!("{:?}, expected [{expected}, {numbers}]", array.shape());
            return Err(misfit(&path, problem));
        }
        match array.iter().all(|x| x.is_finite()) {
            true => Ok(array.to_owned()),
            false => Err(misfit(&path, "it has a NaN or an infinity".into())),
        }
    }
}

fn misfit(path: &Path, problem: String) -> DataError {
    DataError::Listed {
        path: path.into(),
        problem,
    }
}

/// The columns whose names a file lists, of a skeleton; joints that it does not name never turn.
fn columns(
    skeleton: &Skeleton,
    names: &[NameRow],
    path: &Path,
) -> Result<MotionColumns, DataError> {
    let is_named = |joint: &str| names.iter().any(|row| row.name == format!("{joint}_x"));
    let joints = skeleton.joints.iter().map(|joint| NamedRotation {
        joint: joint.name.clone(),
        rotation: DQuat::IDENTITY,
    });
    let (turning, fixed): (Vec<_>, Vec<_>) = joints.partition(|joint| is_named(&joint.joint));
    if turning.is_empty() {
        let problem = "it names the rotation of no joint of skeleton.bvh";
        return Err(misfit(path, problem.into()));
    }
    let columns = MotionColumns::new("skeleton.bvh", turning, fixed)
        .map_err(|error| misfit(path, error.to_string()))?;
    let expected = columns.names();
    let same = names.len() == expected.len();
    let differs = names
        .iter()
        .zip(&expected)
        .find(|(row, (name, _))| row.name != *name);
    match differs {
        Some((row, (name, _))) => Err(misfit(path, format!("{} in place of {name}", row.name))),
        None if !same => {
            let (found, expected) = (names.len(), expected.len());
            Err(misfit(
                path,
                format!("{found} columns, expected {expected}"),
            ))
        }
        None => Ok(columns),
    }
}

fn magnitudes(names: &[NameRow]) -> Vec<usize> {
    let names = names.iter().enumerate();
    let is_magnitude = |row: &NameRow| MAGNITUDES.iter().any(|it| row.name.starts_with(it));
    names
        .filter(|(_, row)| is_magnitude(row))
        .map(|(column, _)| column)
        .collect()
}

fn onset(names: &[NameRow], path: &Path) -> Result<usize, DataError> {
    let onset = names.iter().position(|row| row.name == ONSET);
    onset.ok_or_else(|| misfit(path, format!("it has no column {ONSET}")))
}

fn sorted(times: impl Iterator<Item = f64>, path: &Path) -> Result<Vec<f64>, DataError> {
    let mut times: Vec<f64> = times.collect();
    if times.iter().any(|time| !time.is_finite()) {
        return Err(misfit(path, "it has a time that is not finite".into()));
    }
    times.sort_unstable_by(f64::total_cmp);
    Ok(times)
}

fn piece(
    row: SplitRow,
    dances: &BTreeMap<String, MotoricaDance>,
    path: &Path,
) -> Result<MotoricaPiece, DataError> {
    let SplitRow {
        dance,
        part,
        first_frame,
        end_frame,
    } = row;
    let frames = dances.get(&dance).map_or(0, |it| it.motion.nrows());
    match first_frame < end_frame && end_frame <= frames {
        true => Ok(MotoricaPiece {
            dance,
            part,
            frames: first_frame..end_frame,
        }),
        false => Err(misfit(
            path,
            format!("frames {first_frame} to {end_frame} of {dance}, which has {frames}"),
        )),
    }
}

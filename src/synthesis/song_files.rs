//! The files of a seed and of key poses: what of them a model dances on from, and a dance as the
//! seed's file has motions.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::clip_keyframes::no_frame;
use super::keyframes::{FileKeyframe, KeyframeError, kept_channels, unusable};
use super::own_rig::OwnRig;
use super::retarget::check_rest;
use super::song::{Seed, SongError};
use crate::data::{DataConfig, FileReading, at_its_rate};
use crate::motion::bvh::{self, Axis, Bvh, Channel, channel_layout};
use crate::motion::rest_pose::RestPose;
use crate::motion::rig::RigKeyframe;
use crate::motion::{Clip, Mapping, Pose, Skeleton, resample};

/// Rates that differ by less than this share are one.
const SAME_RATE: f64 = 1e-3;

/// A file that was read.
pub(super) struct SongFile {
    /// In cm, with Y up, at the data's rate; on the dance skeleton where it was mapped.
    pub clip: Clip,
    /// The file's channels, where it was not mapped and every joint turns.
    channels: Option<Vec<Vec<Channel>>>,
    /// Its rig, where the model dances on the dance skeleton.
    rig: Option<OwnRig>,
    /// Its own seconds a frame.
    frame_time: f64,
}

impl SongFile {
    /// A dance as such a file has motions: on its rig, in its unit, axis and rate; or with its
    /// channels, or with Z X Y rotations where these cannot hold it.
    ///
    /// # Errors
    /// The clip is not one that a file could hold.
    pub fn document(&self, dance: &Clip, given: &[RigKeyframe]) -> Result<Bvh, SongError> {
        let Some(rig) = &self.rig else {
            let channels = self.channels.clone();
            let channels =
                channels.unwrap_or_else(|| channel_layout(dance, [Axis::Z, Axis::X, Axis::Y]));
            return Bvh::from_clip(dance, channels).map_err(SongError::Document);
        };
        let mut clip = rig.motion(dance, given);
        if (clip.frame_time / self.frame_time - 1.0).abs() > SAME_RATE {
            clip = resample(clip, 1.0 / self.frame_time)?;
        }
        let channels = rig.channels(&clip);
        Bvh::from_clip(&clip, channels).map_err(SongError::Document)
    }
}

/// A seed and key poses, on the bones of the seed's dancer.
pub(super) struct SongPoses {
    pub skeleton: Skeleton,
    pub seed: Vec<Pose>,
    /// By frame.
    pub keys: Vec<(usize, Pose)>,
    /// The same where they are on the rig of the seed's file, as it has them.
    pub on_rig: Vec<RigKeyframe>,
}

/// The files of a choice as they are read.
pub(super) struct SongFiles<'m> {
    mapping: Option<Mapping>,
    data: DataConfig,
    /// What the model dances on, where that is the dance skeleton in one rest pose.
    rest: Option<RestPose<'m>>,
    read: BTreeMap<PathBuf, SongFile>,
    pub notices: Vec<String>,
}

impl<'m> SongFiles<'m> {
    pub fn new(
        mapping: Option<Mapping>,
        data: &DataConfig,
        rest: Option<RestPose<'m>>,
    ) -> SongFiles<'m> {
        SongFiles {
            mapping,
            data: DataConfig {
                skip_frames: 0,
                ..data.clone()
            },
            rest: rest.filter(|rest| rest.skeleton.is_dance_skeleton()),
            read: BTreeMap::new(),
            notices: Vec::new(),
        }
    }

    /// What brings a clip to the model: nothing where it dances on such clips as they are.
    fn mapping_of(&self, clip: &Clip) -> Result<Option<Mapping>, KeyframeError> {
        if self.rest.is_none() {
            return Ok(self.mapping.clone());
        }
        let mapping = Mapping::onto_dance_skeleton(clip, self.mapping.as_ref())?;
        let mapping = mapping.map(|mapping| mapping.into_owned());
        Ok(Some(match mapping {
            Some(mapping) => mapping,
            None => Mapping::recognised(clip)?,
        }))
    }

    fn file(&mut self, path: &Path) -> Result<&SongFile, KeyframeError> {
        if !self.read.contains_key(path) {
            let file = self.open(path)?;
            self.read.insert(path.into(), file);
        }
        Ok(&self.read[path])
    }

    fn open(&mut self, path: &Path) -> Result<SongFile, KeyframeError> {
        let document = bvh::read(path)?;
        let (clip, rate) = at_its_rate(document.to_clip(), &self.data).map_err(unusable(path))?;
        let frame_time = clip.frame_time;
        let data = DataConfig {
            source_fps: None,
            ..self.data.clone()
        };
        let mapping = self.mapping_of(&clip)?;
        let channels = kept_channels(&document).filter(|_| mapping.is_none());
        let rig = mapping.as_ref().filter(|_| self.rest.is_some());
        let rig = rig.map(|mapping| OwnRig::read(&document, clip.clone(), mapping, &data));
        let rig = rig.transpose().map_err(unusable(path))?;
        let read = FileReading::of(clip, mapping.as_ref(), &data).map_err(unusable(path))?;
        let clip = read.recording.clip;
        // The seed's is read first, and the result is on its rig.
        let on_rig = rig
            .as_ref()
            .filter(|_| !document.skeleton().is_dance_skeleton() && self.read.is_empty());
        let notices = rate.into_iter().chain(read.notices);
        let notices = notices.chain(on_rig.map(OwnRig::notice));
        let notices = notices.chain(rig.as_ref().and_then(OwnRig::stiff_joints));
        let named = notices.map(|notice| format!("{}: {notice}", clip.name));
        self.notices.extend(named);
        Ok(SongFile {
            clip,
            channels,
            rig,
            frame_time,
        })
    }

    /// Poses of a file on the skeleton that the model dances on, with the file's bones.
    fn poses(
        &mut self,
        path: &Path,
        frames: Range<usize>,
    ) -> Result<(Skeleton, Vec<Pose>), SongError> {
        let rest = self.rest;
        let clip = &self.file(path)?.clip;
        let poses = &clip.poses[frames];
        match rest.filter(|rest| !rest.is_of(&clip.skeleton)) {
            Some(rest) => {
                let stood = rest.onto(&clip.skeleton, poses);
                stood.map_err(|source| SongError::RestPose {
                    file: path.into(),
                    source,
                })
            }
            None => Ok((clip.skeleton.clone(), poses.to_vec())),
        }
    }

    fn pose(&mut self, path: &Path, frame: usize) -> Result<(Skeleton, Pose), SongError> {
        let clip = &self.file(path)?.clip;
        if frame >= clip.poses.len() {
            return Err(KeyframeError::from(no_frame(clip, frame)).into());
        }
        let (skeleton, mut poses) = self.poses(path, frame..frame + 1)?;
        Ok((skeleton, poses.remove(0)))
    }

    /// A frame of a file as its rig has it, which is that of the file `first`.
    fn on_rig(
        &self,
        (path, frame): (&Path, usize),
        first: &Path,
        (time, mapped, met): (usize, &Pose, bool),
    ) -> Option<RigKeyframe> {
        let own = self.read[first].rig.as_ref()?;
        let rig = self.read[path]
            .rig
            .as_ref()
            .filter(|rig| rig.is_same(own))?;
        Some(RigKeyframe {
            time,
            pose: rig.pose(frame),
            mapped: mapped.clone(),
            met,
        })
    }

    /// A seed of `needed` frames and key poses of a dance of `frames`.
    ///
    /// # Errors
    /// A file that cannot be read or has not these frames, key poses outside the dance or on other
    /// joints than the seed.
    pub fn given(
        &mut self,
        seed: &Seed,
        keys: &[FileKeyframe],
        needed: usize,
        frames: usize,
    ) -> Result<SongPoses, SongError> {
        let first = seed.file().as_path();
        let (rows, (skeleton, poses)) = match seed {
            Seed::Pose(from) => {
                let (skeleton, pose) = self.pose(&from.file, from.frame)?;
                (vec![from.frame; needed], (skeleton, vec![pose; needed]))
            }
            Seed::Motion(file, start) => {
                let found = self.file(file)?.clip.poses.len();
                let start = start.unwrap_or(found.saturating_sub(needed));
                if start.saturating_add(needed) > found {
                    return Err(SongError::ShortSeed {
                        file: file.clone(),
                        first: start,
                        found: found.saturating_sub(start),
                        needed,
                    });
                }
                let rows = start..start + needed;
                (rows.clone().collect(), self.poses(file, rows)?)
            }
        };
        let keys = self.key_poses(keys, (&skeleton, &poses[0]), needed, frames)?;
        let seed_frames = rows.into_iter().zip(&poses).enumerate();
        let of_seed = seed_frames
            .filter_map(|(time, (row, pose))| self.on_rig((first, row), first, (time, pose, true)));
        let of_keys = keys.iter().filter_map(|(key, pose)| {
            self.on_rig((&key.file, key.frame), first, (key.time, pose, false))
        });
        Ok(SongPoses {
            on_rig: of_seed.chain(of_keys).collect(),
            keys: keys
                .into_iter()
                .map(|(key, pose)| (key.time, pose))
                .collect(),
            skeleton,
            seed: poses,
        })
    }

    /// Key poses by frame, on the bones of the seed's dancer.
    fn key_poses<'k>(
        &mut self,
        asked: &'k [FileKeyframe],
        (skeleton, dancer): (&Skeleton, &Pose),
        seed: usize,
        frames: usize,
    ) -> Result<Vec<(&'k FileKeyframe, Pose)>, SongError> {
        let title = |key: &FileKeyframe| {
            let FileKeyframe { file, frame, time } = key;
            format!("{}:{frame}@{time}", file.display())
        };
        let mut asked: Vec<&FileKeyframe> = asked.iter().collect();
        asked.sort_by_key(|key| key.time);
        let fps = self.data.fps;
        if let Some(pair) = asked.windows(2).find(|pair| pair[0].time == pair[1].time) {
            return Err(SongError::Twice {
                frame: pair[0].time,
                keys: [title(pair[0]), title(pair[1])],
            });
        }
        let mut keys = Vec::new();
        for key in asked {
            if key.time >= frames {
                let (key, last) = (title(key), frames - 1);
                return Err(SongError::Beyond { key, last, fps });
            }
            if key.time < seed {
                let (key, last) = (title(key), seed - 1);
                return Err(SongError::InSeed { key, last, fps });
            }
            let (its_own, mut pose) = self.pose(&key.file, key.frame)?;
            if pose.translations.len() != dancer.translations.len() {
                let files = [key.file.display().to_string(), "the seed's file".into()];
                let joints = [pose.translations.len(), dancer.translations.len()];
                return Err(KeyframeError::OtherJoints { files, joints }.into());
            }
            let name = &self.read[&key.file].clip.name;
            check_rest(&its_own, skeleton, name).map_err(KeyframeError::from)?;
            pose.translations[1..].clone_from_slice(&dancer.translations[1..]);
            keys.push((key, pose));
        }
        Ok(keys)
    }

    /// What was read of a file; the last that is asked.
    pub fn into_file(mut self, path: &Path) -> Option<SongFile> {
        self.read.remove(path)
    }
}

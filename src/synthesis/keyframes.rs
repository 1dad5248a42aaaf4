//! Keyframes from files: which frames of which, and when.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ndarray::{Array2, ArrayView2, s};

use super::foot_cleanup::lift_feet;
pub use super::keyframe_choice::{
    FileFrom, FileKeyframe, KeyframeChoice, LONGEST, Time, TimedFrame,
};
use super::own_frames::OnWholeFrames;
use super::own_rig::OwnRig;
use super::retarget::other_rests;
use super::{KeyframeSource, SequenceRequest, SynthesisError};
use crate::counted::counted;
use crate::data::{DataConfig, DataError, at_its_rate};
use crate::models::transition::DanceClip;
use crate::motion::bvh::{self, Axis, Bvh, BvhError, Channel, channel_layout};
use crate::motion::features::VELOCITY_FACTORS;
use crate::motion::oddities::oddities;
use crate::motion::rig::{RigKeyframe, nearest_frames, spread};
use crate::motion::{Clip, Conversion, Feet, Floor, Mapping, MappingError};

/// Channels of a joint that has none of its own.
const ORDER: [Axis; 3] = [Axis::Z, Axis::X, Axis::Y];
/// Rates within this of each other, as a share, are the same.
const SAME_RATE: f64 = 1e-4;

/// Why files give no keyframes.
#[derive(Debug, thiserror::Error)]
pub enum KeyframeError {
    #[error("--keyframes: frame {frame} follows frame {before}; give ascending frames, each once")]
    Order { before: usize, frame: usize },
    #[error(
        "no keyframes; give --motion FILE.bvh --keyframes 120,180,260, or --keyframe FILE.bvh:FRAME@TIME twice or more"
    )]
    None,
    #[error("one keyframe only; a dance goes from one keyframe to another, give two or more")]
    One,
    #[error(
        "the first keyframe stands at frame {time} of the result; give one at frame 0 (FILE.bvh:FRAME@0)"
    )]
    First { time: usize },
    #[error("two keyframes stand at frame {time} of the result, {} and {}; keep one", files[0], files[1])]
    SameTime { time: usize, files: [String; 2] },
    #[error(transparent)]
    Mapping(#[from] MappingError),
    #[error(transparent)]
    Bvh(#[from] BvhError),
    #[error("{file} cannot be used")]
    Clip {
        file: PathBuf,
        source: Box<DataError>,
    },
    #[error(
        "the result ends at frame {end}, but {file} ends {} after its first keyframe; give earlier keyframes, or --keyframe only",
        counted(*last, "frame")
    )]
    MotionEnds {
        file: PathBuf,
        end: usize,
        last: usize,
    },
    #[error(
        "{} has {} joints, {} has {}; take keyframes from files on one skeleton",
        files[0], joints[0], files[1], joints[1]
    )]
    OtherJoints {
        files: [String; 2],
        joints: [usize; 2],
    },
    #[error(
        "--length puts the last keyframe at frame {end} of the result, beyond {LONGEST} frames; give smaller lengths"
    )]
    TooLong { end: usize },
    #[error(
        "--length gives {} for the {} between {keyframes} keyframes; give one number, or one for each",
        counted(*lengths, "number"), counted(keyframes - 1, "transition")
    )]
    Lengths { lengths: usize, keyframes: usize },
    #[error(
        "{file} has {}, the result needs velocity factors of {needed} from its frame {first} on; give a longer clip or an \
         earlier frame",
        counted(*found, "frame")
    )]
    VelocityEnds {
        file: PathBuf,
        found: usize,
        needed: usize,
        first: usize,
    },
    #[error(transparent)]
    Synthesis(#[from] SynthesisError),
}

/// The keyframes of a choice in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TimedKeyframes {
    /// File, frame and time of every keyframe, by time.
    pub keyframes: Vec<FileKeyframe>,
    /// The dancer's file and its first keyframe.
    pub motion: Option<(PathBuf, usize)>,
}

impl TimedKeyframes {
    /// # Errors
    /// No keyframes, one only, or out of order.
    pub fn of(choice: &KeyframeChoice) -> Result<Self, KeyframeError> {
        let mut keyframes = choice.further.clone();
        let mut motion = None;
        if let Some((file, frames)) = &choice.motion {
            if let Some(pair) = frames.windows(2).find(|pair| pair[1] <= pair[0]) {
                let (before, frame) = (pair[0], pair[1]);
                return Err(KeyframeError::Order { before, frame });
            }
            let first = frames.first().copied().unwrap_or(0);
            motion = Some((file.clone(), first));
            keyframes.extend(frames.iter().map(|&frame| FileKeyframe {
                file: file.clone(),
                frame,
                time: frame - first,
            }));
        }
        keyframes.sort_by_key(|keyframe| keyframe.time);
        match &keyframes[..] {
            [] => return Err(KeyframeError::None),
            [_] => return Err(KeyframeError::One),
            [first, ..] if first.time > 0 => {
                return Err(KeyframeError::First { time: first.time });
            }
            _ => {}
        }
        let same = |pair: &&[FileKeyframe]| pair[0].time == pair[1].time;
        if let Some(pair) = keyframes.windows(2).find(same) {
            return Err(KeyframeError::SameTime {
                time: pair[0].time,
                files: [&pair[0], &pair[1]]
                    .map(|keyframe| format!("{}:{}", keyframe.file.display(), keyframe.frame)),
            });
        }
        Ok(Self { keyframes, motion })
    }
}

/// The channels of a file where every joint turns: those that a result is written with.
pub(super) fn kept_channels(document: &Bvh) -> Option<Vec<Vec<Channel>>> {
    let turns = |channels: &Vec<Channel>| {
        let rotations = channels
            .iter()
            .filter(|c| matches!(c, Channel::Rotation(_)));
        rotations.count() == 3
    };
    let channels = document.channels();
    channels.iter().all(turns).then(|| channels.to_vec())
}

/// Times of keyframes by the frames from each to the next: none where none are given, one number
/// for all, or one for each.
pub(super) fn lengthened(
    lengths: &[u32],
    keyframes: usize,
) -> Result<Option<Vec<usize>>, KeyframeError> {
    let lengths = match *lengths {
        [] => return Ok(None),
        [length] => vec![length as usize; keyframes - 1],
        _ if lengths.len() != keyframes - 1 => {
            let lengths = lengths.len();
            return Err(KeyframeError::Lengths { lengths, keyframes });
        }
        _ => lengths.iter().map(|&length| length as usize).collect(),
    };
    let mut times = vec![0];
    for length in lengths {
        times.push(times[times.len() - 1] + length);
    }
    let end = times[times.len() - 1];
    match end > LONGEST as usize {
        true => Err(KeyframeError::TooLong { end }),
        false => Ok(Some(times)),
    }
}

pub(super) fn unusable(path: &Path) -> impl Fn(DataError) -> KeyframeError {
    move |source| KeyframeError::Clip {
        file: path.into(),
        source: source.into(),
    }
}

/// A file that was read.
struct Source {
    clip: DanceClip,
    /// The file's channels, where it is on the dance skeleton and every joint turns.
    channels: Option<Vec<Vec<Channel>>>,
    /// The file's own rig, where it is not the dance skeleton.
    rig: Option<OwnRig>,
    /// Seconds from one frame of the file to the next.
    frame_time: f64,
}

/// The keyframes of a result with the files that they come from.
pub struct Keyframes {
    sources: BTreeMap<PathBuf, Source>,
    /// File, frame and time of every keyframe, by time.
    keyframes: Vec<FileKeyframe>,
    /// The dancer's file and its first keyframe.
    motion: Option<(PathBuf, usize)>,
    mapping: Option<Mapping>,
    data: DataConfig,
    /// Frames from each keyframe to the next, where they are to be others than the clip's.
    lengths: Vec<u32>,
    /// When the keyframes are, in frames of the dancer's file, where these count.
    own_times: Option<Vec<usize>>,
    notices: Vec<String>,
}

impl Keyframes {
    /// Reads the files of a choice, in the unit, axis and rate of `data`; frames count from the
    /// first of a file, also where `data` leaves first frames out. `lengths`: frames from each
    /// keyframe of the dancer's clip to the next, none for their own distances, one for all, or one
    /// for each.
    ///
    /// # Errors
    /// No keyframes, keyframes out of order, a file that cannot be read or is on another skeleton,
    /// lengths that do not fit.
    pub fn read(
        choice: &KeyframeChoice,
        lengths: &[u32],
        data: &DataConfig,
    ) -> Result<Self, KeyframeError> {
        let TimedKeyframes { keyframes, motion } = TimedKeyframes::of(choice)?;
        let mapping = match &choice.mapping {
            Some(path) => Some(Mapping::read(path)?),
            None => data.mapping.clone(),
        };
        let mut read = Self {
            sources: BTreeMap::new(),
            keyframes,
            motion,
            mapping,
            data: DataConfig {
                skip_frames: 0,
                ..data.clone()
            },
            lengths: lengths.to_vec(),
            own_times: None,
            notices: Vec::new(),
        };
        if choice.own_frames {
            read.read_own_frames()?;
        }
        for keyframe in read.keyframes.clone() {
            if !read.sources.contains_key(&keyframe.file) {
                let (source, notices) = read.source(&keyframe.file)?;
                read.notices.extend(notices);
                read.sources.insert(keyframe.file.clone(), source);
            }
        }
        if !choice.own_frames {
            read.notices.extend(read.counted_otherwise());
        }
        let clips = read.keyframes.iter();
        let clips = clips.map(|it| &read.sources[&it.file].clip.clip);
        read.notices.extend(other_rests(clips));
        Ok(read)
    }

    /// What is odd about the files, or was recognised and converted; no error.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// That a file's rows of poses, which are to be put elsewhere in time, are counted at another
    /// rate than its own.
    fn counted_otherwise(&self) -> Option<String> {
        let (path, _) = self.motion.as_ref().filter(|_| !self.lengths.is_empty())?;
        let (source, fps) = (&self.sources[path], self.data.fps);
        let own = 1.0 / source.frame_time;
        let last = self.keyframes.last()?.frame;
        ((own / fps - 1.0).abs() > SAME_RATE).then(|| {
            format!(
                "{}: --keyframes count at {fps} frames a second, the file has {own:.4}: frame {last} \
                 is its frame {:.1}; for poses made by hand give --own-frames",
                source.clip.name,
                last as f64 * own / fps
            )
        })
    }

    /// Reads the dancer's file with its keyframes as whole frames.
    fn read_own_frames(&mut self) -> Result<(), KeyframeError> {
        let Some((path, first)) = self.motion.clone() else {
            return Ok(());
        };
        let document = bvh::read(&path)?;
        let (clip, notices) = self.at_its_rate(&path, document.to_clip())?;
        let frame_time = clip.frame_time;
        let rows: Vec<usize> = self.keyframes.iter().map(|it| it.frame).collect();
        let own_times = lengthened(&self.lengths, rows.len())?;
        if own_times.is_some() {
            // What is between poses that are put elsewhere in time is no recording.
            self.motion = None;
            self.lengths.clear();
        }
        let made = OnWholeFrames::of(clip, &rows, own_times, self.data.fps)?;
        let start = made.frames.first().copied().unwrap_or(first);
        for (keyframe, &frame) in self.keyframes.iter_mut().zip(&made.frames) {
            (keyframe.frame, keyframe.time) = (frame, frame - start);
        }
        self.own_times = Some(made.own_times);
        let of_dancer = oddities(&made.clip);
        let (source, mut more) = self.source_of(&path, &document, made.clip, frame_time)?;
        if self.motion.is_none() {
            // What is odd between poses that were made by hand is no dancer's.
            more.retain(|notice| !of_dancer.iter().any(|odd| notice.ends_with(odd)));
        }
        self.motion = self.motion.take().map(|(path, _)| (path, start));
        self.notices.extend(notices.into_iter().chain(more));
        self.sources.insert(path, source);
        Ok(())
    }

    fn source(&self, path: &Path) -> Result<(Source, Vec<String>), KeyframeError> {
        let document = bvh::read(path)?;
        let (clip, mut notices) = self.at_its_rate(path, document.to_clip())?;
        let frame_time = clip.frame_time;
        let (source, more) = self.source_of(path, &document, clip, frame_time)?;
        notices.extend(more);
        Ok((source, notices))
    }

    fn at_its_rate(&self, path: &Path, clip: Clip) -> Result<(Clip, Vec<String>), KeyframeError> {
        let (clip, notices) = at_its_rate(clip, &self.data).map_err(unusable(path))?;
        let named = notices
            .iter()
            .map(|notice| format!("{}: {notice}", clip.name));
        let named = named.collect();
        Ok((clip, named))
    }

    /// A file whose clip has been given its rate, `frame_time` its own.
    fn source_of(
        &self,
        path: &Path,
        document: &Bvh,
        clip: Clip,
        frame_time: f64,
    ) -> Result<(Source, Vec<String>), KeyframeError> {
        let data = DataConfig {
            source_fps: None,
            ..self.data.clone()
        };
        // Unit and axis of the file are the result's, too.
        let (conversion, _) = Conversion::of(&clip, data.unit, data.up);
        let mapping = match Mapping::onto_dance_skeleton(&clip, self.mapping.as_ref())? {
            None if self.own_times.is_some() || !conversion.is_none() => {
                Some(Cow::Owned(Mapping::recognised(&clip)?))
            }
            mapping => mapping,
        };
        let channels = kept_channels(document).filter(|_| mapping.is_none());
        let rig = mapping.as_ref();
        let rig = rig.map(|mapping| OwnRig::read(document, clip.clone(), mapping, &data));
        let rig = rig.transpose().map_err(unusable(path))?;
        let (clip, mut notices) =
            DanceClip::from_file(clip, mapping.as_deref(), &data).map_err(unusable(path))?;
        let on_rig = rig
            .as_ref()
            .filter(|_| !document.skeleton().is_dance_skeleton());
        notices.extend(on_rig.map(|rig| format!("{}: {}", clip.name, rig.notice())));
        let stiff = rig.as_ref().and_then(OwnRig::stiff_joints);
        notices.extend(stiff.map(|stiff| format!("{}: {stiff}", clip.name)));
        let source = Source {
            clip,
            channels,
            rig,
            frame_time,
        };
        Ok((source, notices))
    }

    /// Velocity factors of a further file, read on the same terms, in `frames` frames from its
    /// frame `first` on, `[frames, 5]`, cm/frame; and notices of a file that was not read before.
    ///
    /// # Errors
    /// It cannot be read, is on another skeleton or ends too early.
    pub fn velocity_factors(
        &self,
        path: &Path,
        first: usize,
        frames: usize,
    ) -> Result<(Array2<f64>, Vec<String>), KeyframeError> {
        let (read, mut notices);
        notices = Vec::new();
        let clip = match self.sources.get(path) {
            Some(source) => &source.clip,
            None => {
                (read, notices) = self.source(path)?;
                &read.clip
            }
        };
        if clip.frames().saturating_sub(first) < frames {
            return Err(KeyframeError::VelocityEnds {
                file: path.into(),
                found: clip.frames(),
                needed: frames,
                first,
            });
        }
        let rows = s![first..first + frames, VELOCITY_FACTORS];
        Ok((clip.features.slice(rows).to_owned(), notices))
    }

    /// The dancer's clip.
    pub fn motion(&self) -> Option<&DanceClip> {
        let (path, _) = self.motion.as_ref()?;
        Some(&self.sources[path].clip)
    }

    /// What the dancer does in the frames of a request, `[F, 154]`; none where the request has
    /// other keyframes than its, or has them at other distances.
    pub fn recorded(&self, request: &SequenceRequest) -> Option<ArrayView2<'_, f64>> {
        let (path, first) = self.motion.as_ref()?;
        let its_own = |keyframe: &FileKeyframe| {
            keyframe.file == *path && keyframe.frame == first + keyframe.time
        };
        let times = self.keyframes.iter().map(|keyframe| keyframe.time);
        let frames = *first..*first + request.frames();
        let clip = &self.sources[path].clip;
        let runs_along = self.keyframes.iter().all(its_own)
            && times.eq(request.times())
            && frames.end <= clip.frames();
        runs_along.then(|| clip.features.slice(s![frames, ..]))
    }

    /// A result, whose keyframes are at `times`, as a file's content: on the rig of the first
    /// keyframe's file, in its unit, axis and rate; or, from a file on the dance skeleton, with its
    /// channels, or with Z X Y rotations where these cannot hold it. Feet that were pinned to a
    /// floor are above it at that rate, too.
    ///
    /// # Errors
    /// The clip is not one that a file could hold.
    pub fn document(
        &self,
        result: &Clip,
        times: &[usize],
        pinned_to: Option<&(Feet, Floor)>,
    ) -> Result<Bvh, BvhError> {
        let first = self.keyframes.first();
        let Some(first) = first.map(|first| &self.sources[&first.file]) else {
            return Bvh::from_clip(result, channel_layout(result, ORDER));
        };
        let (mut clip, mut times) = (result.clone(), times.to_vec());
        if let Some((own_times, frame_time)) = self.times_in_document(&times) {
            clip = spread(clip, &times, &own_times, frame_time);
            times = own_times;
            if let Some((feet, floor)) = pinned_to {
                lift_feet(&clip.skeleton, &mut clip.poses, feet, floor, &times);
            }
        }
        if let Some(own) = &first.rig {
            clip = own.motion(&clip, &self.on_rig(own, &times));
        }
        let channels = match &first.rig {
            Some(own) => own.channels(&clip),
            None => {
                let kept = first.channels.clone();
                kept.unwrap_or_else(|| channel_layout(&clip, ORDER))
            }
        };
        Bvh::from_clip(&clip, channels)
    }

    /// The frames of a [document](Keyframes::document) that frames `times` of a result become, and
    /// its seconds a frame, where these are others: the nearest of the rate of a rig's file, or
    /// those that were asked for.
    pub fn times_in_document(&self, times: &[usize]) -> Option<(Vec<usize>, f64)> {
        let first = &self.sources[&self.keyframes.first()?.file];
        let ratio = 1.0 / (first.frame_time * self.data.fps);
        let own_times = match &self.own_times {
            Some(own_times) => own_times.clone(),
            None if first.rig.is_none() || (ratio - 1.0).abs() < SAME_RATE => return None,
            None => nearest_frames(times, ratio),
        };
        Some((own_times, first.frame_time))
    }

    /// The keyframes whose files are on this rig.
    fn on_rig(&self, own: &OwnRig, times: &[usize]) -> Vec<RigKeyframe> {
        let keyframes = self.keyframes.iter().zip(times);
        let on_it = keyframes.filter_map(|(keyframe, &time)| {
            let source = &self.sources[&keyframe.file];
            let rig = source.rig.as_ref().filter(|rig| rig.is_same(own))?;
            Some(RigKeyframe {
                time,
                pose: rig.pose(keyframe.frame),
                mapped: source.clip.clip.poses[keyframe.frame].clone(),
                met: true,
            })
        });
        on_it.collect()
    }

    /// The request: trajectory and velocity factors of the dancer's clip where there is one.
    ///
    /// # Errors
    /// Frames that a file does not have; dancers that do not fit each other; keyframes beyond the
    /// end of the dancer's clip; lengths that do not fit the keyframes.
    pub fn request(&self) -> Result<SequenceRequest, KeyframeError> {
        let sources: Vec<KeyframeSource> = self
            .keyframes
            .iter()
            .map(|keyframe| KeyframeSource {
                clip: &self.sources[&keyframe.file].clip,
                frame: keyframe.frame,
                time: keyframe.time,
            })
            .collect();
        let request = SequenceRequest::from_keyframes(&sources)?;
        let Some(((path, first), clip)) = self.motion.as_ref().zip(self.motion()) else {
            return Ok(request);
        };
        let last = clip.frames() - 1 - first;
        if request.frames() - 1 > last {
            return Err(KeyframeError::MotionEnds {
                file: path.clone(),
                end: request.frames() - 1,
                last,
            });
        }
        let request = request.like(clip, *first)?;
        match lengthened(&self.lengths, self.keyframes.len())? {
            Some(times) => Ok(request.at_times(&times)?),
            None => Ok(request),
        }
    }
}

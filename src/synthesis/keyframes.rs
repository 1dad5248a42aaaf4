//! Keyframes from files: which frames of which, and when.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use ndarray::{Array2, ArrayView2, s};

use super::{KeyframeSource, SequenceRequest, SynthesisError};
use crate::counted::counted;
use crate::data::{DataConfig, DataError};
use crate::models::transition::DanceClip;
use crate::motion::bvh::{self, Axis, Bvh, BvhError, Channel, channel_layout};
use crate::motion::features::VELOCITY_FACTORS;
use crate::motion::{Clip, Mapping, MappingError};

/// Frames of a result at most: an hour at 30 a second.
pub const LONGEST: u32 = 108_000;

/// A time of the result: "375", frames, or "12.5s", seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Time {
    Frame(usize),
    Seconds(f64),
}

impl FromStr for Time {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let text = text.trim();
        let beyond = |frames: f64| frames > f64::from(LONGEST);
        let time = match text.strip_suffix('s') {
            Some(seconds) => seconds.trim().parse().ok().map(Self::Seconds),
            None => text.parse().ok().map(Self::Frame),
        };
        match time {
            Some(Self::Frame(frame)) if beyond(frame as f64) => {
                Err(format!("TIME {frame} is beyond {LONGEST} frames"))
            }
            Some(Self::Seconds(seconds)) if !(0.0..=86_400.0).contains(&seconds) => {
                Err(format!("TIME {seconds}s is not from 0 to 86400 seconds"))
            }
            Some(time) => Ok(time),
            None => Err("expected a frame such as 375, or seconds such as 12.5s".into()),
        }
    }
}

impl Time {
    /// The nearest frame at so many a second.
    pub fn frame(self, fps: f64) -> usize {
        match self {
            Self::Frame(frame) => frame,
            Self::Seconds(seconds) => (seconds * fps).round() as usize,
        }
    }
}

/// A frame of a file, and when it is to be met: "FILE.bvh:FRAME@TIME".
#[derive(Debug, Clone, PartialEq)]
pub struct TimedFrame {
    pub file: PathBuf,
    /// Frame of the file at the data's rate.
    pub frame: usize,
    pub time: Time,
}

impl FromStr for TimedFrame {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let expected = "expected FILE.bvh:FRAME@TIME, FRAME a whole number from 0 on, TIME one or \
                        seconds such as 12.5s";
        let (rest, time) = text.rsplit_once('@').ok_or(expected)?;
        let (file, frame) = rest.rsplit_once(':').ok_or(expected)?;
        let frame = frame.trim().parse().map_err(|_| expected)?;
        let file = Some(PathBuf::from(file)).filter(|file| !file.as_os_str().is_empty());
        Ok(Self {
            file: file.ok_or(expected)?,
            frame,
            time: time.parse()?,
        })
    }
}

impl TimedFrame {
    /// The same at so many frames a second.
    pub fn at(&self, fps: f64) -> FileKeyframe {
        FileKeyframe {
            file: self.file.clone(),
            frame: self.frame,
            time: self.time.frame(fps),
        }
    }
}

/// A frame of a file as a keyframe.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileKeyframe {
    pub file: PathBuf,
    /// Frame of the file at the data's rate.
    pub frame: usize,
    /// Frame of the result.
    pub time: usize,
}

/// Which keyframes a result has.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct KeyframeChoice {
    /// A dancer's file, which gives the controls between its keyframes, too, and its frames that
    /// are keyframes, ascending: the first becomes frame 0 of the result, the others keep their
    /// distances.
    pub motion: Option<(PathBuf, Vec<usize>)>,
    /// Keyframes beside those.
    pub further: Vec<FileKeyframe>,
    /// For clips on another skeleton than the dance skeleton, in place of the data's.
    pub mapping: Option<PathBuf>,
}

impl KeyframeChoice {
    /// The files that it names.
    pub fn files(&self) -> Vec<&PathBuf> {
        let motion = self.motion.iter().map(|(file, _)| file);
        let further = self.further.iter().map(|keyframe| &keyframe.file);
        motion.chain(further).chain(&self.mapping).collect()
    }
}

/// A file, and the frame from which on it is read: `FILE.bvh[:FRAME]`, without FRAME the first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FileFrom {
    pub file: PathBuf,
    pub frame: usize,
    /// Whether FRAME was said.
    said: bool,
}

impl FileFrom {
    /// The frame, where it was said.
    pub fn given(&self) -> Option<usize> {
        self.said.then_some(self.frame)
    }
}

impl FromStr for FileFrom {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let framed = text.rsplit_once(':');
        // A drive's letter, too, stands before a colon.
        let is_name = text.to_lowercase().ends_with(".bvh");
        let (file, frame) = match framed.filter(|_| !is_name) {
            Some((file, frame)) => match frame.trim().parse() {
                Ok(frame) => (file, Some(frame)),
                Err(_) => {
                    return Err(
                        "expected FILE.bvh or FILE.bvh:FRAME, FRAME a whole number from 0 \
                                on"
                        .into(),
                    );
                }
            },
            None => (text, None),
        };
        Ok(Self {
            file: file.into(),
            frame: frame.unwrap_or(0),
            said: frame.is_some(),
        })
    }
}

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

/// A file that was read.
struct Source {
    clip: DanceClip,
    /// The file's channels, where it is on the dance skeleton and every joint turns.
    channels: Option<Vec<Vec<Channel>>>,
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
    notices: Vec<String>,
}

impl Keyframes {
    /// Reads the files of a choice, in the unit, axis and rate of `data`; frames count from the
    /// first of a file, also where `data` leaves first frames out.
    ///
    /// # Errors
    /// No keyframes, keyframes out of order, a file that cannot be read or is on another skeleton.
    pub fn read(choice: &KeyframeChoice, data: &DataConfig) -> Result<Self, KeyframeError> {
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
            notices: Vec::new(),
        };
        for keyframe in read.keyframes.clone() {
            if !read.sources.contains_key(&keyframe.file) {
                let (source, notices) = read.source(&keyframe.file)?;
                read.notices.extend(notices);
                read.sources.insert(keyframe.file.clone(), source);
            }
        }
        Ok(read)
    }

    /// What is odd about the files, or was recognised and converted; no error.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    fn source(&self, path: &Path) -> Result<(Source, Vec<String>), KeyframeError> {
        let document = bvh::read(path)?;
        let clip = document.to_clip();
        let own = clip.skeleton.is_dance_skeleton();
        let channels = kept_channels(&document).filter(|_| own);
        let mapping = self.mapping.as_ref().filter(|_| !own);
        let (clip, notices) =
            DanceClip::from_file(clip, mapping, &self.data).map_err(|source| {
                KeyframeError::Clip {
                    file: path.into(),
                    source: source.into(),
                }
            })?;
        Ok((Source { clip, channels }, notices))
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

    /// A result as a file's content: with the channels of the first keyframe's file, or with Z X Y
    /// rotations where these cannot hold it.
    ///
    /// # Errors
    /// The clip is not one that a file could hold.
    pub fn document(&self, result: &Clip) -> Result<Bvh, BvhError> {
        let first = self.keyframes.first();
        let channels = first.and_then(|first| self.sources[&first.file].channels.clone());
        let channels =
            channels.unwrap_or_else(|| channel_layout(result, [Axis::Z, Axis::X, Axis::Y]));
        Bvh::from_clip(result, channels)
    }

    /// The request: trajectory and velocity factors of the dancer's clip where there is one.
    /// `lengths`: frames from each of its keyframes to the next, none for their own distances, one
    /// for all, or one for each.
    ///
    /// # Errors
    /// Frames that a file does not have; dancers that do not fit each other; keyframes beyond the
    /// end of the dancer's clip; lengths that do not fit the keyframes.
    pub fn request(&self, lengths: &[u32]) -> Result<SequenceRequest, KeyframeError> {
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
        match lengthened(lengths, self.keyframes.len())? {
            Some(times) => Ok(request.at_times(&times)?),
            None => Ok(request),
        }
    }
}

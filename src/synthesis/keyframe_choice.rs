//! Which keyframes are asked for: frames of files, and when they are to be met.

use std::ffi::{OsStr, OsString};
use std::path::{Path, PathBuf};
use std::str::FromStr;

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

impl TryFrom<OsString> for TimedFrame {
    type Error = String;

    /// The same where the file's name is no UTF-8.
    fn try_from(text: OsString) -> Result<Self, String> {
        let read: Self = text.to_string_lossy().parse()?;
        let file = named(&text, &read.file);
        Ok(Self { file, ..read })
    }
}

/// The file's name at the beginning of an argument, whose name as text is `read`.
#[cfg(unix)]
fn named(argument: &OsStr, read: &Path) -> PathBuf {
    use std::os::unix::ffi::OsStrExt as _;

    let behind = argument.to_string_lossy().len() - read.as_os_str().len();
    let name = &argument.as_bytes()[..argument.len() - behind];
    OsStr::from_bytes(name).into()
}

#[cfg(not(unix))]
fn named(_argument: &OsStr, read: &Path) -> PathBuf {
    read.into()
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
    /// The dancer's frames, and the lengths between them, count at its file's own rate.
    pub own_frames: bool,
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

impl TryFrom<OsString> for FileFrom {
    type Error = String;

    /// The same where the file's name is no UTF-8.
    fn try_from(text: OsString) -> Result<Self, String> {
        let read: Self = text.to_string_lossy().parse()?;
        let file = named(&text, &read.file);
        Ok(Self { file, ..read })
    }
}

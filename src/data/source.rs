//! Clips whose poses lie in memory or in a file.

use std::borrow::Cow;
use std::ops::Range;

use super::dataset::DataError;
use super::prepared::StoredClip;
use crate::motion::{Clip, Pose, Skeleton};

/// A clip to train on, wherever its poses are.
#[derive(Debug, Clone)]
pub enum ClipSource<'d> {
    Held(Cow<'d, Clip>),
    Stored(&'d StoredClip),
}

impl ClipSource<'_> {
    /// The file's name with its extension.
    pub fn name(&self) -> &str {
        match self {
            Self::Held(clip) => &clip.name,
            Self::Stored(clip) => clip.name(),
        }
    }

    pub fn skeleton(&self) -> &Skeleton {
        match self {
            Self::Held(clip) => &clip.skeleton,
            Self::Stored(clip) => clip.skeleton(),
        }
    }

    /// Seconds from one frame to the next.
    pub fn frame_time(&self) -> f64 {
        match self {
            Self::Held(clip) => clip.frame_time,
            Self::Stored(clip) => clip.frame_time(),
        }
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        match self {
            Self::Held(clip) => clip.poses.len(),
            Self::Stored(clip) => clip.frames(),
        }
    }

    /// The clip in memory.
    ///
    /// # Errors
    /// The file that it lies in cannot be read, or is not what was written.
    pub fn whole(&self) -> Result<Cow<'_, Clip>, DataError> {
        match self {
            Self::Held(clip) => Ok(Cow::Borrowed(clip)),
            Self::Stored(clip) => Ok(Cow::Owned(clip.whole()?)),
        }
    }

    /// The poses of these frames.
    ///
    /// # Errors
    /// The file that they lie in cannot be read.
    ///
    /// # Panics
    /// The clip does not have them.
    pub fn poses(&self, frames: Range<usize>) -> Result<Cow<'_, [Pose]>, DataError> {
        match self {
            Self::Held(clip) => Ok(Cow::Borrowed(&clip.poses[frames])),
            Self::Stored(clip) => Ok(Cow::Owned(clip.poses(frames)?)),
        }
    }
}

//! The forms in which a clip is trained: as recorded, in the mirror, at other tempi. None is held:
//! the frames of a form are made when they are asked for.

use std::borrow::Cow;
use std::ops::Range;

use crate::data::{ClipSource, DataError};
use crate::motion::mirror::mirrored_poses;
use crate::motion::resample::Resampled;
use crate::motion::tempo::frames_at_tempo;
use crate::motion::{Pose, ResampleError};

/// A form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Form {
    /// None for the recorded one.
    pub tempo: Option<f64>,
    pub mirrored: bool,
}

/// A clip in a form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClipForm {
    tempo: Option<Resampled>,
    mirrored: bool,
    frames: usize,
}

/// All forms in their order: the recorded one, in the mirror if that is trained, then the same at
/// each tempo.
pub(super) fn forms(mirror: bool, tempi: &[f64]) -> Vec<Form> {
    let tempi = std::iter::once(None).chain(tempi.iter().copied().map(Some));
    let sides = [false, true].into_iter().take(1 + usize::from(mirror));
    tempi
        .flat_map(|tempo| sides.clone().map(move |mirrored| Form { tempo, mirrored }))
        .collect()
}

impl ClipForm {
    /// # Errors
    /// The clip would be too long at the tempo.
    pub fn new(
        clip: &ClipSource<'_>,
        Form { tempo, mirrored }: Form,
    ) -> Result<Self, ResampleError> {
        let named = (clip.name(), clip.frame_time());
        let tempo = tempo.map(|tempo| frames_at_tempo(named, clip.frames(), tempo));
        let tempo = tempo.transpose()?;
        Ok(Self {
            frames: tempo.map_or(clip.frames(), |tempo| tempo.len()),
            tempo,
            mirrored,
        })
    }

    /// How many it has.
    pub fn frames(&self) -> usize {
        self.frames
    }

    pub fn is_mirrored(&self) -> bool {
        self.mirrored
    }

    /// Frames of it; `clip` is the recorded one, `partners` the joint on the body's other side of
    /// each, see [`crate::motion::mirror::partners`].
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn poses<'c>(
        &self,
        clip: &'c ClipSource<'_>,
        partners: &[usize],
        frames: Range<usize>,
    ) -> Result<Cow<'c, [Pose]>, DataError> {
        let poses = match self.tempo {
            None => clip.poses(frames)?,
            Some(tempo) => {
                let between = clip.poses(tempo.between(frames.clone()))?;
                Cow::Owned(tempo.poses(frames, &between))
            }
        };
        Ok(match self.mirrored {
            true => Cow::Owned(mirrored_poses(partners, &poses)),
            false => poses,
        })
    }
}

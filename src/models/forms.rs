//! The forms in which a clip is trained: as recorded, in the mirror, at other tempi. None is held:
//! the frames of a form are made when they are asked for.

use std::borrow::Cow;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::settings::ValueError;
use crate::data::{ClipSource, DataError};
use crate::motion::mirror::mirrored_poses;
use crate::motion::resample::Resampled;
use crate::motion::tempo::frames_at_tempo;
use crate::motion::{Pose, ResampleError};

/// What is trained beside the recorded windows; the papers train nothing else.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AugmentationConfig {
    /// Each window that is trained is with probability 1/2 the one that a mirror shows, see
    /// [`crate::motion::mirror_image`].
    pub mirror: bool,
    /// Each window that is trained is, with the same probability, of the recorded clip or of the
    /// same clip at one of these tempi (1.25: a quarter faster), see [`crate::motion::at_tempo`];
    /// of the recorded one where it would be too long for that at this tempo. 16 at most, each from
    /// 0.25 to 4.
    pub tempi: Vec<f64>,
}

impl AugmentationConfig {
    /// # Errors
    /// Tempi out of range, or too many.
    pub fn check(&self) -> Result<(), ValueError> {
        let tempi = &self.tempi;
        let usable = tempi.len() <= 16 && tempi.iter().all(|tempo| (0.25..=4.0).contains(tempo));
        ValueError::unless(
            usable,
            "augmentation.tempi",
            format!("{tempi:?}"),
            "at most 16 tempi from 0.25 to 4",
        )
    }

    /// All forms in their order: the recorded one, in the mirror if that is trained, then the same
    /// at each tempo.
    pub(super) fn forms(&self) -> Vec<Form> {
        let tempi = std::iter::once(None).chain(self.tempi.iter().copied().map(Some));
        let sides = [false, true].into_iter().take(1 + usize::from(self.mirror));
        tempi
            .flat_map(|tempo| sides.clone().map(move |mirrored| Form { tempo, mirrored }))
            .collect()
    }
}

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

//! What is trained beside the recorded clips: their mirror images, and both at other tempi.

use rand::RngExt as _;
use rayon::prelude::*;

use super::settings::AugmentationConfig;
use super::task::StepPlan;
use super::{DanceClip, Window};
use crate::data::{DataConfig, DataError};
use crate::models::Streams;

/// The forms in which clips are trained, one after the other: all as recorded, in the mirror where
/// those are trained, then the same at each tempo.
pub(super) struct Augmentation {
    /// Recorded clips.
    recorded: usize,
    /// 2 with mirror images, 1 without.
    sides: usize,
    tempi: usize,
}

impl Augmentation {
    /// The clips in all their forms.
    ///
    /// # Errors
    /// A clip in the mirror or at a tempo cannot be measured.
    pub fn of(
        recorded: Vec<DanceClip>,
        augmentation: &AugmentationConfig,
        data: &DataConfig,
    ) -> Result<(Self, Vec<DanceClip>), DataError> {
        let forms = Self {
            recorded: recorded.len(),
            sides: 1 + usize::from(augmentation.mirror),
            tempi: augmentation.tempi.len(),
        };
        let images = |clips: &[DanceClip]| match augmentation.mirror {
            true => of_each(clips, |clip| clip.mirror_image(data)),
            false => Ok(Vec::new()),
        };
        let mut faster = Vec::new();
        for &tempo in &augmentation.tempi {
            let changed = of_each(&recorded, |clip| clip.at_tempo(tempo, data))?;
            let images = images(&changed)?;
            faster.extend(changed.into_iter().chain(images));
        }
        let images = images(&recorded)?;
        let clips = recorded.into_iter().chain(images).chain(faster).collect();
        Ok((forms, clips))
    }

    /// How many of the clips, from the first on, are at the recorded tempo.
    pub fn at_recorded_tempo(&self) -> usize {
        self.recorded * self.sides
    }

    /// Draws in which of its clip's forms each window of a step is seen; those of `plan` are of
    /// recorded clips, `clips` are in all forms.
    pub fn vary(&self, plan: &mut StepPlan, clips: &[DanceClip], streams: &Streams, step: u64) {
        let length = plan.length;
        let windows = plan.windows.iter_mut().map(|window| (window, length));
        let single_frames = plan.single_frames.iter_mut();
        let single_frames = single_frames.map(|plan| (&mut plan.window, plan.length));
        let (mut tempi, mut sides) = (
            streams.stream("tempi", &[step]),
            streams.stream("mirroring", &[step]),
        );
        for (window, length) in windows.chain(single_frames) {
            if self.tempi > 0 {
                let tempo = tempi.random_range(0..=self.tempi);
                *window = self.at_tempo(*window, length, tempo, clips);
            }
            if self.sides > 1 && sides.random() {
                window.clip += self.recorded;
            }
        }
    }

    /// The window of `length` + 1 frames at about the same place of its clip at the tempo of this
    /// number, 0 for the recorded one.
    fn at_tempo(&self, window: Window, length: usize, tempo: usize, clips: &[DanceClip]) -> Window {
        let clip = window.clip + self.at_recorded_tempo() * tempo;
        let [recorded, frames] = [window.clip, clip].map(|clip| clips[clip].features.nrows());
        match frames.checked_sub(length + 1) {
            Some(last) => Window {
                clip,
                start: (window.start * frames / recorded).min(last),
            },
            None => window,
        }
    }
}

fn of_each(
    clips: &[DanceClip],
    make: impl Fn(&DanceClip) -> Result<DanceClip, DataError> + Sync + Send,
) -> Result<Vec<DanceClip>, DataError> {
    let made: Vec<_> = clips.par_iter().map(&make).collect();
    made.into_iter().collect()
}

//! What is trained beside the recorded clips: their mirror images, and both at other tempi.

use rand::RngExt as _;
use rayon::prelude::*;

use super::Window;
use crate::data::{DanceClip, DataError};
use crate::experiment::config::ExperimentConfig;
use crate::models::streams::Streams;
use crate::training::error::TrainingError;
use crate::training::step::{StepPlan, TrainingClip};

/// The forms in which clips are trained, one after the other: all as recorded, in the mirror where those are trained, then the same at each tempo.
pub(crate) struct Augmentation {
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
    pub fn of<'d>(
        recorded: &'d [DanceClip],
        config: &ExperimentConfig,
    ) -> Result<(Self, Vec<TrainingClip<'d>>), TrainingError> {
        let augmentation = &config.augmentation;
        let images = |clips: &[DanceClip]| match augmentation.mirror {
            true => of_each(clips, |clip| clip.mirror_image(&config.data)),
            false => Ok(Vec::new()),
        };
        let mut clips: Vec<_> = recorded.iter().map(TrainingClip::of).collect();
        clips.extend(images(recorded)?.into_iter().map(TrainingClip::owning));
        for &tempo in &augmentation.tempi {
            let changed = of_each(recorded, |clip| clip.at_tempo(tempo, &config.data))?;
            let images = images(&changed)?;
            clips.extend(changed.into_iter().chain(images).map(TrainingClip::owning));
        }
        let forms = Self {
            recorded: recorded.len(),
            sides: 1 + usize::from(augmentation.mirror),
            tempi: augmentation.tempi.len(),
        };
        Ok((forms, clips))
    }

    /// How many of the clips, from the first on, are at the recorded tempo.
    pub fn at_recorded_tempo(&self) -> usize {
        self.recorded * self.sides
    }

    /// Draws in which of its clip's forms each window of a step is seen; those of `plan` are of recorded clips, `clips` are in all forms.
    pub fn vary(
        &self,
        plan: &mut StepPlan,
        clips: &[TrainingClip<'_>],
        streams: &Streams,
        step: u64,
    ) {
        let length = plan.length;
        let windows = plan.windows.iter_mut().map(|window| (window, length));
        let single_frames = plan.single_frames.iter_mut();
        let single_frames = single_frames.map(|plan| (&mut plan.window, plan.length));
        let (mut tempi, mut sides) = (streams.tempi(step), streams.mirroring(step));
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

    /// The window of `length` + 1 frames at about the same place of its clip at the tempo of this number, 0 for the recorded one.
    fn at_tempo(
        &self,
        window: Window,
        length: usize,
        tempo: usize,
        clips: &[TrainingClip<'_>],
    ) -> Window {
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
    make: impl Fn(&DanceClip) -> Result<DanceClip, DataError> + Sync,
) -> Result<Vec<DanceClip>, Box<DataError>> {
    let made = clips.par_iter().map(|clip| make(clip).map_err(Box::new));
    made.collect()
}

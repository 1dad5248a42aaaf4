//! Clips in the forms in which their windows are trained, each window made when it is asked for.

use std::borrow::Cow;
use std::ops::Range;

use ndarray::{Array2, ArrayView2};
use rayon::prelude::*;

use super::Window;
use crate::data::{ClipSource, DataError};
use crate::models::forms::{ClipForm, Form};
use crate::models::scratch::{Place, Scratch};
use crate::motion::facing::{FacingJoints, facing_angles};
use crate::motion::features::features_facing;
use crate::motion::mirror::partners;
use crate::motion::{FeatureConfig, Pose};

/// Clips that are measured at a time, for every thread.
const AT_ONCE: usize = 2;

/// Clips on the dance skeleton in all their forms: clip `i` of form `f` has the number
/// `f * recorded + i`. Of a form the facing angles are kept, as these need the whole clip.
pub(super) struct TrainingClips<'d> {
    recorded: Vec<ClipSource<'d>>,
    forms: Vec<TrainedForm>,
    features: FeatureConfig,
    /// The joint on the body's other side of each.
    partners: Vec<usize>,
    facing: Scratch,
}

/// A clip in one form.
struct TrainedForm {
    /// Which of the recorded ones.
    of: usize,
    form: ClipForm,
    /// Of every frame, rad, followed along the clip.
    facing: Place,
}

/// A window, measured.
pub(super) struct MeasuredWindow {
    /// Of the window's frames and, unless it begins with the clip, of the one before, `[frames,
    /// 154]`, not standardised; the facing angle followed along the clip.
    pub features: Array2<f64>,
    /// The row of the window's first frame.
    pub start: usize,
    /// Of the frames of `features`.
    pub poses: Vec<Pose>,
}

impl<'d> TrainingClips<'d> {
    /// # Errors
    /// A clip that cannot be measured or brought to a tempo, or whose poses cannot be read.
    pub fn new(
        recorded: Vec<ClipSource<'d>>,
        forms: &[Form],
        features: FeatureConfig,
        facing: Scratch,
    ) -> Result<Self, DataError> {
        for clip in &recorded {
            features.check(clip.name(), clip.skeleton(), clip.frames())?;
        }
        let first = recorded.first();
        let mut clips = Self {
            partners: first.map_or_else(Vec::new, |clip| partners(clip.skeleton())),
            recorded,
            forms: Vec::new(),
            features,
            facing,
        };
        let measured: Vec<_> = clips
            .recorded
            .par_iter()
            .enumerate()
            .map(|(of, clip)| {
                let held = ClipSource::Held(clip.whole()?);
                let forms = forms.iter().map(|&form| clips.in_form(of, &held, form));
                forms.collect::<Result<Vec<_>, DataError>>()
            })
            .collect();
        let mut measured: Vec<_> = measured
            .into_iter()
            .map(|forms| forms.map(Vec::into_iter))
            .collect::<Result<_, _>>()?;
        for _ in forms {
            clips
                .forms
                .extend(measured.iter_mut().filter_map(Iterator::next));
        }
        Ok(clips)
    }

    fn in_form(
        &self,
        of: usize,
        clip: &ClipSource<'_>,
        form: Form,
    ) -> Result<TrainedForm, DataError> {
        let form = ClipForm::new(clip, form)?;
        let poses = form.poses(clip, &self.partners, 0..form.frames())?;
        let world = clip.skeleton().world_positions(&poses);
        let sigma = self.features.facing_sigma;
        let facing = facing_angles(&world, &FacingJoints::DANCE, sigma);
        Ok(TrainedForm {
            of,
            form,
            facing: self.facing.keep_numbers(&facing)?,
        })
    }

    /// Frames of the clips in all forms.
    pub fn frames(&self) -> Vec<usize> {
        self.forms.iter().map(|it| it.form.frames()).collect()
    }

    /// Features of frames of a clip in its form, `[frames, 154]`, the first of them as the first of
    /// a clip; and their poses.
    fn measure(
        &self,
        clip: usize,
        frames: Range<usize>,
    ) -> Result<(Array2<f64>, Cow<'_, [Pose]>), DataError> {
        let &TrainedForm { of, form, facing } = &self.forms[clip];
        let recorded = &self.recorded[of];
        let poses = form.poses(recorded, &self.partners, frames.clone())?;
        let world = recorded.skeleton().world_positions(&poses);
        let threshold = self.features.contact_threshold;
        let facing = self.facing.numbers(facing, frames)?;
        let features = features_facing(&world, &facing, threshold);
        Ok((features, poses))
    }

    /// The `length` + 1 frames of a window.
    ///
    /// # Errors
    /// Their poses cannot be read.
    pub fn window(&self, window: Window, length: usize) -> Result<MeasuredWindow, DataError> {
        // Velocities and contacts follow from the frame before.
        let first = window.start.saturating_sub(1);
        let frames = first..window.start + length + 1;
        let (features, poses) = self.measure(window.clip, frames)?;
        Ok(MeasuredWindow {
            features,
            start: window.start - first,
            poses: poses.into_owned(),
        })
    }

    /// Goes through the features of whole clips, each `[frames, 154]`, in their order.
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn each(
        &self,
        clips: Range<usize>,
        visit: &mut dyn FnMut(ArrayView2<'_, f64>),
    ) -> Result<(), DataError> {
        let numbers: Vec<usize> = clips.collect();
        for numbers in numbers.chunks(AT_ONCE * rayon::current_num_threads()) {
            let whole = |&clip: &usize| self.measure(clip, 0..self.forms[clip].form.frames());
            let measured: Vec<_> = numbers.par_iter().map(whole).collect();
            for features in measured {
                visit(features?.0.view());
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::data::choreography::{ChoreographyConfig, generate};
    use crate::models::AugmentationConfig;
    use crate::models::transition::DanceClip;
    use crate::motion::{Clip, at_tempo, mirror_image};

    fn clips() -> Vec<Clip> {
        let config = ChoreographyConfig {
            clips: 2,
            frames_per_clip: 70,
            seed: 5,
        };
        let generated = generate(&config).unwrap().into_iter();
        generated.map(|it| it.clip).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]

        #[test]
        fn a_window_of_a_form_is_cut_from_the_clip_in_that_form_to_the_bit(
            tempo in 0.5f64..2.0, number in 0usize..8, start in 0usize..30, length in 1usize..5,
            in_memory in prop::sample::select(vec![0usize, 1 << 20]),
        ) {
            let recorded = clips();
            let sources = recorded.iter().map(|clip| ClipSource::Held(Cow::Borrowed(clip)));
            let features = FeatureConfig::default();
            let forms = AugmentationConfig { mirror: true, tempi: vec![tempo] }.forms();
            let facing = Scratch::holding(in_memory);
            let made = TrainingClips::new(sources.collect(), &forms, features, facing).unwrap();
            let (form, clip) = (forms[number / 2], number % 2);
            let mut held = recorded[clip].clone();
            if let Some(tempo) = form.tempo {
                held = at_tempo(held, tempo).unwrap();
            }
            if form.mirrored {
                held = mirror_image(&held);
            }
            let measured = DanceClip::measure(held, &features).unwrap();
            prop_assert_eq!(made.frames()[number], measured.frames());
            let window = Window { clip: number, start };
            let cut = made.window(window, length).unwrap();
            let frames = start..=start + length;
            let rows = measured.features.slice(ndarray::s![frames.clone(), ..]);
            prop_assert_eq!(cut.features.slice(ndarray::s![cut.start.., ..]), rows);
            prop_assert_eq!(&cut.poses[cut.start..], &measured.clip.poses[frames]);
        }
    }
}

//! Clips that are trained, and how their windows become network input.

use std::sync::Arc;

use ndarray::{Array2, Array3, ArrayViewMut2, Axis};

use super::single_frames::SingleFramePlan;
use super::training_clips::TrainingClips;
use super::{
    DanceClip, Network, PoseWindows, RootFrame, SingleFrame, Standardisation, TrainedModel, Window,
};
use crate::autograd::{Parameters, Real};
use crate::data::DataError;
use crate::models::Generator;
use crate::motion::Mapping;
use crate::motion::features::FEATURES;

/// What is trained, and how it is standardised.
pub(super) struct TrainingWindows<'d> {
    pub clips: TrainingClips<'d>,
    pub standardisation: Standardisation,
    pub root_frame: RootFrame,
    /// How the clips were brought onto the dance skeleton.
    pub mapping: Option<Mapping>,
}

impl TrainingWindows<'_> {
    /// Standardised features of windows of `length` + 1 frames, `[length + 1, windows, 154]`, and,
    /// if asked for, their poses.
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn cut(
        &self,
        windows: &[Window],
        length: usize,
        poses: bool,
    ) -> Result<(Array3<f32>, Option<PoseWindows<f32>>), DataError> {
        let frames = length + 1;
        let mut features = Array3::zeros((frames, windows.len(), FEATURES));
        let mut cut = poses.then(|| PoseWindows::zeros(frames, windows.len()));
        for (k, &window) in windows.iter().enumerate() {
            let measured = self.clips.window(window, length)?;
            let start = measured.start;
            let cut_features = self
                .root_frame
                .window_features(&measured.features, start, length);
            let target = features.index_axis_mut(Axis(1), k);
            write_standardised(target, &self.standardisation, &cut_features);
            if let Some(cut) = &mut cut {
                cut.write(k, 0..frames, &measured.poses[start..]);
            }
        }
        Ok((features, cut))
    }

    /// Single frames with the standardised features of their windows.
    ///
    /// # Errors
    /// Poses cannot be read.
    pub fn single_frames(
        &self,
        plans: &[SingleFramePlan],
    ) -> Result<Vec<SingleFrame<f32>>, DataError> {
        plans
            .iter()
            .map(|plan| {
                let (window, _) = self.cut(&[plan.window], plan.length, false)?;
                Ok(SingleFrame {
                    window,
                    frame: plan.frame,
                })
            })
            .collect()
    }

    /// A network of these windows with weights, as a model.
    pub fn model(
        &self,
        name: &str,
        network: &Arc<dyn Network<f32>>,
        parameters: Parameters<f32>,
    ) -> Box<dyn Generator> {
        let model = TrainedModel::new(
            name.into(),
            network.clone(),
            parameters,
            self.standardisation.clone(),
            self.root_frame,
        );
        Box::new(model.seeing_through(self.mapping.clone()))
    }
}

/// Features of windows of `length` + 1 frames of clips, `[length + 1, windows, 154]`, standardised
/// in the frame of reference that goes with the statistics.
pub(super) fn features_of<T: Real>(
    clips: &[DanceClip],
    windows: &[Window],
    length: usize,
    (standardisation, root_frame): (&Standardisation, RootFrame),
) -> Array3<T> {
    let mut features = Array3::zeros((length + 1, windows.len(), FEATURES));
    for (target, window) in features.axis_iter_mut(Axis(1)).zip(windows) {
        let clip = &clips[window.clip].features;
        let cut = root_frame.window_features(clip, window.start, length);
        write_standardised(target, standardisation, &cut);
    }
    features
}

fn write_standardised<T: Real>(
    mut target: ArrayViewMut2<'_, T>,
    standardisation: &Standardisation,
    features: &Array2<f64>,
) {
    let standardised = standardisation.standardise(features.view());
    target.assign(&standardised.mapv(T::from_f64));
}

/// Poses of the same windows.
pub(super) fn poses_of<T: Real>(
    clips: &[DanceClip],
    windows: &[Window],
    length: usize,
) -> PoseWindows<T> {
    let mut cut = PoseWindows::zeros(length + 1, windows.len());
    for (k, window) in windows.iter().enumerate() {
        let poses = &clips[window.clip].clip.poses[window.start..];
        cut.write(k, 0..=length, poses);
    }
    cut
}

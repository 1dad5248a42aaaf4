//! Clips that are trained, and how their windows become network input.

use std::sync::Arc;

use ndarray::{Array3, Axis};

use super::single_frames::SingleFramePlan;
use super::{
    DanceClip, Network, PoseWindows, RootFrame, SingleFrame, Standardisation, TrainedModel, Window,
};
use crate::autograd::{Parameters, Real};
use crate::models::Generator;
use crate::motion::Mapping;
use crate::motion::features::FEATURES;

/// What is trained, and how it is standardised.
pub(super) struct TrainingWindows {
    pub clips: Vec<DanceClip>,
    pub standardisation: Standardisation,
    pub root_frame: RootFrame,
    /// How the clips were brought onto the dance skeleton.
    pub mapping: Option<Mapping>,
}

impl TrainingWindows {
    /// Standardised features of windows of `length` + 1 frames, `[length + 1, windows, 154]`.
    pub fn features(&self, windows: &[Window], length: usize) -> Array3<f32> {
        let shown = (&self.standardisation, self.root_frame);
        features_of(&self.clips, windows, length, shown)
    }

    /// Single frames with the standardised features of their windows.
    pub fn single_frames(&self, plans: &[SingleFramePlan]) -> Vec<SingleFrame<f32>> {
        plans
            .iter()
            .map(|plan| SingleFrame {
                window: self.features(&[plan.window], plan.length),
                frame: plan.frame,
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
    for (mut target, window) in features.axis_iter_mut(Axis(1)).zip(windows) {
        let clip = &clips[window.clip].features;
        let cut = root_frame.window_features(clip, window.start, length);
        let standardised = standardisation.standardise(cut.view());
        target.assign(&standardised.mapv(T::from_f64));
    }
    features
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

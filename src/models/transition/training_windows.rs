//! Clips that are trained, and how their windows become network input.

use ndarray::{Array3, Axis};

use super::single_frames::SingleFramePlan;
use super::{DanceClip, PoseWindows, RootFrame, SingleFrame, Standardisation, Window};
use crate::motion::features::FEATURES;

/// What is trained, and how it is standardised.
pub(super) struct TrainingWindows {
    pub clips: Vec<DanceClip>,
    pub standardisation: Standardisation,
    pub root_frame: RootFrame,
}

impl TrainingWindows {
    /// Standardised features of windows of `length` + 1 frames, `[length + 1, windows, 154]`.
    pub fn features(&self, windows: &[Window], length: usize) -> Array3<f32> {
        let mut features = Array3::zeros((length + 1, windows.len(), FEATURES));
        for (k, window) in windows.iter().enumerate() {
            let clip = &self.clips[window.clip].features;
            let cut = self.root_frame.window_features(clip, window.start, length);
            features.index_axis_mut(Axis(1), k).assign(
                &self
                    .standardisation
                    .standardise(cut.view())
                    .mapv(|x| x as f32),
            );
        }
        features
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

    /// Poses of the same windows; none where a clip has none of its own.
    pub fn poses(&self, windows: &[Window], length: usize) -> Option<PoseWindows<f32>> {
        let mut cut = PoseWindows::zeros(length + 1, windows.len());
        for (k, window) in windows.iter().enumerate() {
            let frames = window.start..=window.start + length;
            let poses = &self.clips[window.clip].clip.poses;
            cut.write(k, 0..=length, poses.get(frames)?);
        }
        Some(cut)
    }
}

//! Dances in the numbers that scores are made of.

use glam::DVec3;
use ndarray::{Array2, ArrayView2, s};

use super::HEIGHT;
use super::beat_alignment::DanceBeats;
use super::divergence::leaves;
use super::diversity::within_dance_diversity;
use super::freezing::{freezes, mean_joint_speed};
use crate::data::Recording;
use crate::models::ModelError;
use crate::models::dance_features::{Scale, fit_motion};
use crate::motion::{Clip, MotionColumns, Pose, Skeleton};

/// What the training part says dances are measured by.
pub(super) struct Measure {
    columns: MotionColumns,
    scale: Scale,
    fps: f64,
    /// Mean joint speed of the training part, cm/s.
    usual_speed: f64,
    /// Raw columns of the training pieces.
    pub training: Vec<Array2<f64>>,
}

/// A dance, its seed left out.
pub(super) struct Dance {
    /// `[frames, D]`, cm and rad.
    pub raw: Array2<f64>,
    /// By the training part.
    pub standardised: Array2<f64>,
    pub beats: DanceBeats,
    pub freezes: bool,
    pub diverges: bool,
    pub diversity: Option<f64>,
}

impl Measure {
    /// Of a training part, each of whose joints is a column where it turns.
    ///
    /// # Errors
    /// No clip, or one of other joints or another rate.
    pub fn of(training: &[Recording]) -> Result<Self, ModelError> {
        let clips: Vec<&Clip> = training.iter().map(|it| &it.clip).collect();
        let (columns, scale, raw) = fit_motion(&clips, false, false)?;
        let fps = clips.first().map_or(0.0, |clip| 1.0 / clip.frame_time);
        let speeds: Vec<f64> = clips
            .iter()
            .flat_map(|clip| mean_joint_speed(&world(&clip.skeleton, &clip.poses), fps))
            .collect();
        Ok(Self {
            columns,
            scale,
            fps,
            usual_speed: speeds.iter().sum::<f64>() / speeds.len().max(1) as f64,
            training: raw,
        })
    }

    pub fn fps(&self) -> f64 {
        self.fps
    }

    /// Poses of a dance from frame `seed` on; those before say how its first frame moves.
    ///
    /// # Errors
    /// Joints that the training part has are missing.
    pub fn dance(
        &self,
        what: &str,
        skeleton: &Skeleton,
        poses: &[Pose],
        seed: usize,
    ) -> Result<Dance, ModelError> {
        let raw = self.columns.measure_poses(what, skeleton, poses);
        let raw = raw.map_err(|error| ModelError::data(&error))?;
        let raw = raw.slice(s![seed.min(poses.len()).., ..]).to_owned();
        let standardised = self.standardise(raw.view());
        let height: Vec<f64> = raw.column(HEIGHT).to_vec();
        let speed = mean_joint_speed(&world(skeleton, &poses[seed.min(poses.len())..]), self.fps);
        Ok(Dance {
            beats: DanceBeats::of(&height, self.fps),
            freezes: freezes(&speed, self.usual_speed, self.fps),
            diverges: leaves(standardised.view()).is_some(),
            diversity: within_dance_diversity(standardised.view(), self.fps),
            raw,
            standardised,
        })
    }

    fn standardise(&self, raw: ArrayView2<'_, f64>) -> Array2<f64> {
        (&raw - &self.scale.mean) / &self.scale.deviation
    }

    /// The training part's mean, held for so many frames, `[frames, D]`.
    pub fn mean_pose(&self, frames: usize) -> Array2<f64> {
        Array2::from_shape_fn((frames, self.scale.mean.len()), |(_, column)| {
            self.scale.mean[column]
        })
    }
}

fn world(skeleton: &Skeleton, poses: &[Pose]) -> Vec<Vec<DVec3>> {
    skeleton.world_positions(poses)
}

//! Where the root goes.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use ndarray::{Array2, s};

use super::rows_of;
use crate::motion::features::{FACING, ROOT_VELOCITY};
use crate::motion::placement::vector;
use crate::synthesis::request::check_shape;
use crate::synthesis::retarget::move_root;
use crate::synthesis::{SequenceRequest, SynthesisError};

impl SequenceRequest {
    /// The same on another root trajectory, `[F, 3]`, cm: every keyframe's root is moved onto it,
    /// its pose and direction unchanged. Also how far each keyframe was moved, cm.
    ///
    /// # Errors
    /// A trajectory with another number of rows than F, or other than three columns.
    pub fn on_trajectory(
        mut self,
        trajectory: Array2<f64>,
    ) -> Result<(Self, Vec<f64>), SynthesisError> {
        check_shape("the root trajectory", &trajectory, (self.frames(), 3))?;
        self.root_trajectory = trajectory;
        let mut moved = Vec::with_capacity(self.keyframes.len());
        for timed in &mut self.keyframes {
            let place = vector(self.root_trajectory.row(timed.time));
            moved.push(timed.keyframe.pose.translations[0].distance(place));
            move_root(&mut timed.keyframe, place);
        }
        Ok((self, moved))
    }

    /// Turned by `angle` (rad) about the vertical through the first keyframe's root: trajectory and
    /// keyframes together.
    pub fn turned(mut self, angle: f64) -> Self {
        let turn = DQuat::from_rotation_y(angle);
        let centre = self.centre();
        for mut row in self.root_trajectory.rows_mut() {
            let turned = centre + turn * (vector(row.view()) - centre);
            row.assign(&ndarray::aview1(&turned.to_array()));
        }
        for timed in &mut self.keyframes {
            let keyframe = &mut timed.keyframe;
            let place = centre + turn * (keyframe.pose.translations[0] - centre);
            keyframe.pose.rotations[0] = (turn * keyframe.pose.rotations[0]).normalize();
            move_root(keyframe, place);
            keyframe.features[FACING.start] += angle;
            let mut velocity = keyframe.features.slice_mut(s![ROOT_VELOCITY]);
            let turned = turn * vector(velocity.view());
            velocity.assign(&ndarray::aview1(&turned.to_array()));
        }
        self
    }

    /// The trajectory `scale` times as large in x and z, from the first keyframe's root on; heights
    /// stay. Keyframes go with it.
    ///
    /// # Errors
    /// A scale that is not a positive number.
    pub fn scaled(mut self, scale: f64) -> Result<Self, SynthesisError> {
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(SynthesisError::Value {
                what: "the trajectory's scale",
                value: scale,
                expected: "a positive number",
            });
        }
        let centre = self.centre();
        let factor = DVec3::new(scale, 1.0, scale);
        for mut row in self.root_trajectory.rows_mut() {
            let scaled = centre + factor * (vector(row.view()) - centre);
            row.assign(&ndarray::aview1(&scaled.to_array()));
        }
        for timed in &mut self.keyframes {
            let place = centre + factor * (timed.keyframe.pose.translations[0] - centre);
            move_root(&mut timed.keyframe, place);
            let mut velocity = timed.keyframe.features.slice_mut(s![ROOT_VELOCITY]);
            let scaled = factor * vector(velocity.view());
            velocity.assign(&ndarray::aview1(&scaled.to_array()));
        }
        Ok(self)
    }

    /// The trajectory raised (or, below 0, lowered) between the keyframes: by `height` (cm)
    /// halfway, by nothing at the keyframes, along a cosine. So the keyframes keep their feet on
    /// the floor, and the root asks for a jump or a squat on the way, as in the paper's figure 6.
    pub fn raised(mut self, height: f64) -> Self {
        let times = self.times();
        for pair in times.windows(2) {
            let length = (pair[1] - pair[0]) as f64;
            for frame in pair[0]..pair[1] {
                let share = (frame - pair[0]) as f64 / length;
                self.root_trajectory[[frame, 1]] += height * 0.5 * (1.0 - (TAU * share).cos());
            }
        }
        self
    }

    /// Root positions of the keyframes, in their order, cm.
    pub fn keyframe_roots(&self) -> Vec<DVec3> {
        let root = |timed: &super::super::TimedKeyframe| timed.keyframe.pose.translations[0];
        self.keyframes.iter().map(root).collect()
    }

    fn centre(&self) -> DVec3 {
        let first = self.keyframes.first();
        first.map_or(DVec3::ZERO, |timed| timed.keyframe.pose.translations[0])
    }

    /// The same on a path through points, one a frame, cm: [`SequenceRequest::on_trajectory`].
    ///
    /// # Errors
    /// Another number of points than F.
    pub fn on_path(self, points: &[DVec3]) -> Result<(Self, Vec<f64>), SynthesisError> {
        self.on_trajectory(rows_of(points))
    }
}

//! From a document to a clip: channels become local transforms.

use glam::{DQuat, DVec3};
use ndarray::ArrayView1;

use super::document::{Axis, Bvh, Channel};
use crate::motion::{Clip, Pose};

impl Bvh {
    /// The motion as local translations (cm) and rotations of every joint in every frame.
    pub fn to_clip(&self) -> Clip {
        Clip {
            name: self.name.clone(),
            skeleton: self.skeleton.clone(),
            frame_time: self.frame_time,
            poses: self
                .motion
                .rows()
                .into_iter()
                .map(|row| self.pose(row))
                .collect(),
        }
    }

    fn pose(&self, row: ArrayView1<f64>) -> Pose {
        let mut values = row.iter();
        let mut pose = Pose {
            translations: Vec::new(),
            rotations: Vec::new(),
        };
        for (joint, channels) in self.skeleton.joints.iter().zip(&self.channels) {
            let (mut translation, mut rotation) = (joint.offset, DQuat::IDENTITY);
            for (channel, &value) in channels.iter().zip(values.by_ref()) {
                match channel {
                    Channel::Position(axis) => translation[axis.index()] = value,
                    Channel::Rotation(axis) => {
                        rotation *= DQuat::from_axis_angle(unit(*axis), value.to_radians())
                    }
                }
            }
            pose.translations.push(translation);
            pose.rotations.push(rotation.normalize());
        }
        pose
    }
}

fn unit(axis: Axis) -> DVec3 {
    DVec3::AXES[axis.index()]
}

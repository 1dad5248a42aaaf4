//! From a clip to a document: local transforms become channels.

use glam::{DQuat, DVec3};
use ndarray::Array2;

use super::document::{Axis, Bvh, Channel};
use super::error::BvhError;
use super::euler::euler_angles;
use crate::motion::{Clip, Pose};

/// A joint whose translation leaves its offset by more than this moves in its parent's frame, cm.
const STILL: f64 = 1e-6;
/// A joint without rotation channels may be turned by no more than this, rad.
const UNTURNED: f64 = 1e-6;

/// Channels that hold a clip's motion: three rotations a joint in the order `order` (three
/// different axes), and three positions before them for the root and for every joint that moves in
/// its parent's frame. `[joints]`.
pub fn channel_layout(clip: &Clip, order: [Axis; 3]) -> Vec<Vec<Channel>> {
    let positions = [Axis::X, Axis::Y, Axis::Z].map(Channel::Position);
    clip.skeleton
        .joints
        .iter()
        .enumerate()
        .map(|(index, joint)| {
            let moves = |pose: &Pose| pose.translations[index].distance(joint.offset) > STILL;
            let translated = joint.parent.is_none() || clip.poses.iter().any(moves);
            let positions = positions.into_iter().filter(|_| translated);
            positions.chain(order.map(Channel::Rotation)).collect()
        })
        .collect()
}

impl Bvh {
    /// A clip as a document with these channels for each joint, `[joints]`: no rotation or three,
    /// any positions, in any order. [`channel_layout`] gives channels that fit.
    ///
    /// # Errors
    /// The channels cannot hold the motion (the error names joint and frame), or the clip could not
    /// be read back from a file.
    pub fn from_clip(clip: &Clip, channels: Vec<Vec<Channel>>) -> Result<Self, BvhError> {
        let fault = |fault: String| BvhError::Document {
            name: clip.name.clone(),
            fault,
        };
        let joints = &clip.skeleton.joints;
        if channels.len() != joints.len() {
            return Err(fault(format!(
                "{} joints have {} lists of channels",
                joints.len(),
                channels.len()
            )));
        }
        let orders: Vec<Option<[Axis; 3]>> = joints
            .iter()
            .zip(&channels)
            .map(|(joint, channels)| {
                rotation_order(channels).ok_or_else(|| {
                    fault(format!(
                        "joint {} needs no rotation channel, or one about each axis",
                        joint.name
                    ))
                })
            })
            .collect::<Result<_, _>>()?;
        let mut values = Vec::new();
        let mut previous: Vec<Option<[f64; 3]>> = vec![None; joints.len()];
        for (frame, pose) in clip.poses.iter().enumerate() {
            if pose.translations.len() != joints.len() || pose.rotations.len() != joints.len() {
                return Err(fault(format!(
                    "frame {frame} is not a pose of its {} joints",
                    joints.len()
                )));
            }
            for (index, joint) in joints.iter().enumerate() {
                let (translation, rotation) = (pose.translations[index], pose.rotations[index]);
                if !held(translation, joint.offset, &channels[index]) {
                    let text = format!(
                        "joint {} leaves its offset in frame {frame} and lacks position channels",
                        joint.name
                    );
                    return Err(fault(text));
                }
                match orders[index] {
                    Some(order) => {
                        previous[index] = Some(euler_angles(rotation, order, previous[index]))
                    }
                    None if rotation.angle_between(DQuat::IDENTITY) > UNTURNED => {
                        return Err(fault(format!(
                            "joint {} turns in frame {frame} and has no rotation channels",
                            joint.name
                        )));
                    }
                    None => {}
                }
                let angles = orders[index].zip(previous[index]);
                values.extend(
                    channels[index]
                        .iter()
                        .map(|channel| value(*channel, translation, angles)),
                );
            }
        }
        let columns: usize = channels.iter().map(Vec::len).sum();
        let motion =
            Array2::from_shape_vec((clip.poses.len(), columns), values).map_err(|error| {
                fault(format!(
                    "its motion has no rows of {columns} values ({error})"
                ))
            })?;
        Self::new(
            clip.name.clone(),
            clip.skeleton.clone(),
            channels,
            clip.frame_time,
            motion,
        )
    }
}

/// The axes of a joint's rotation channels: all three, or none.
fn rotation_order(channels: &[Channel]) -> Option<Option<[Axis; 3]>> {
    let axes: Vec<Axis> = channels
        .iter()
        .filter_map(|channel| match channel {
            Channel::Rotation(axis) => Some(*axis),
            Channel::Position(_) => None,
        })
        .collect();
    match axes[..] {
        [] => Some(None),
        [a, b, c] if a != b && b != c && a != c => Some(Some([a, b, c])),
        _ => None,
    }
}

/// Whether offset and position channels together give the translation.
fn held(translation: DVec3, offset: DVec3, channels: &[Channel]) -> bool {
    [Axis::X, Axis::Y, Axis::Z].into_iter().all(|axis| {
        let apart = (translation[axis.index()] - offset[axis.index()]).abs();
        apart <= STILL || channels.contains(&Channel::Position(axis))
    })
}

fn value(channel: Channel, translation: DVec3, angles: Option<([Axis; 3], [f64; 3])>) -> f64 {
    match channel {
        Channel::Position(axis) => translation[axis.index()],
        Channel::Rotation(axis) => angles.map_or(0.0, |(order, angles)| {
            order
                .into_iter()
                .zip(angles)
                .filter(|(of, _)| *of == axis)
                .map(|(_, angle)| angle)
                .sum()
        }),
    }
}

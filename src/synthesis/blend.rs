//! A predicted transition is bent onto the keyframes at its ends.
//!
//! What the prediction misses is added as an offset that decays: at the start over the first frames
//! after the pose that the transition starts from, so that neither place nor velocity jumps there;
//! at the end over the last frames before the keyframe, so that the motion runs into it with the
//! velocity that was predicted. Offsets are rotations of each joint, the root's place and the
//! facing angle, so bones keep their lengths. The curve is the quintic of inertial blending (Bollo
//! 2018): value and velocity given at one end; value, velocity and acceleration 0 at the other.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use crate::models::transition::window::wrap;
use crate::motion::Pose;

/// Frames over which an offset decays.
pub(super) const BLEND: usize = 20;

/// Poses of a transition, frame k1 + 1 to k2, with their facing angles.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Track {
    pub poses: Vec<Pose>,
    pub facing: Vec<f64>,
}

/// Where a transition starts: the pose at k1 and, where there is one, the pose before it.
pub(super) struct Start<'a> {
    pub pose: &'a Pose,
    pub facing: f64,
    pub before: Option<(&'a Pose, f64)>,
}

/// Bends `track` so that it goes on from `start` and ends in `target`, whose facing angle is
/// `target_facing` up to whole turns.
pub(super) fn blend(track: &mut Track, start: &Start<'_>, target: &Pose, target_facing: f64) {
    let length = track.poses.len();
    let frames = BLEND.min(length);
    let joints = target.rotations.len();
    let first = Decay::new(frames);
    let poses = track.poses.iter();
    let root: Vec<DVec3> = poses.map(|pose| pose.translations[0]).collect();
    let before = start.before.map(|(pose, _)| pose.translations[0]);
    let (from, to) = (start.pose.translations[0], target.translations[0]);
    let offset = Offset::new(&root, from, before, to);
    for (index, pose) in track.poses.iter_mut().enumerate() {
        pose.translations[0] += offset.at(&first, index, length);
    }
    let before = start.before.map(|(_, facing)| facing);
    let facing = |angle: f64| DVec3::new(angle, 0.0, 0.0);
    let angles: Vec<DVec3> = track.facing.iter().map(|&angle| facing(angle)).collect();
    let last = track.facing[length - 1];
    let (from, to) = (start.facing, last + wrap(target_facing - last));
    let offset = Offset::new(&angles, facing(from), before.map(facing), facing(to));
    for (index, angle) in track.facing.iter_mut().enumerate() {
        *angle += offset.at(&first, index, length).x;
    }
    for joint in 0..joints {
        let poses = track.poses.iter();
        let rotations: Vec<DQuat> = poses.map(|pose| pose.rotations[joint]).collect();
        let before = start.before.map(|(pose, _)| pose.rotations[joint]);
        let (from, to) = (start.pose.rotations[joint], target.rotations[joint]);
        let offset = Offset::turning(&rotations, from, before, to);
        for (index, pose) in track.poses.iter_mut().enumerate() {
            let turn = DQuat::from_scaled_axis(offset.end_at(&first, index, length))
                * DQuat::from_scaled_axis(offset.start_at(&first, index));
            pose.rotations[joint] = (turn * pose.rotations[joint]).normalize();
        }
    }
    // The last pose is the keyframe to the last bit.
    track.poses[length - 1].clone_from(target);
}

/// The offsets of one quantity: at the start (value and velocity) and at the end (value).
struct Offset {
    start: DVec3,
    velocity: DVec3,
    end: DVec3,
}

impl Offset {
    /// Of something that adds; `values` of the frames after the start.
    fn new(values: &[DVec3], start: DVec3, before: Option<DVec3>, target: DVec3) -> Self {
        let first = values[0];
        let speed = values.get(1).map_or(DVec3::ZERO, |second| *second - first);
        // What the prediction would have been at the start itself.
        let origin = first - speed;
        Self {
            start: start - origin,
            velocity: before.map_or(DVec3::ZERO, |before| (start - before) - speed),
            end: target - values[values.len() - 1],
        }
    }

    /// Of rotations: offsets are rotation vectors of turns that come after the predicted rotation.
    fn turning(values: &[DQuat], start: DQuat, before: Option<DQuat>, target: DQuat) -> Self {
        let first = values[0];
        let step = values
            .get(1)
            .map_or(DQuat::IDENTITY, |second| *second * first.inverse());
        let origin = step.inverse() * first;
        let offset = rotation_vector(start * origin.inverse());
        let velocity = before.map_or(DVec3::ZERO, |before| {
            let next = start * before.inverse() * start;
            nearest(rotation_vector(next * first.inverse()), offset) - offset
        });
        Self {
            start: offset,
            velocity,
            end: rotation_vector(target * values[values.len() - 1].inverse()),
        }
    }

    /// The offset at index `index` of `length` frames, frame k1 + 1 + `index`.
    fn at(&self, decay: &Decay, index: usize, length: usize) -> DVec3 {
        self.start_at(decay, index) + self.end_at(decay, index, length)
    }

    fn start_at(&self, decay: &Decay, index: usize) -> DVec3 {
        let [value, velocity] = decay.at(index + 1);
        value * self.start + velocity * self.velocity
    }

    fn end_at(&self, decay: &Decay, index: usize, length: usize) -> DVec3 {
        decay.at(length - 1 - index)[0] * self.end
    }
}

/// The quintic that decays over some frames.
struct Decay {
    frames: f64,
}

impl Decay {
    fn new(frames: usize) -> Self {
        Self {
            frames: frames as f64,
        }
    }

    /// Shares of the value and of the velocity (per frame) at the start that are left after
    /// `frames` frames.
    fn at(&self, frames: usize) -> [f64; 2] {
        let s = frames as f64 / self.frames;
        if s >= 1.0 {
            return [0.0, 0.0];
        }
        let (s3, s4, s5) = (s.powi(3), s.powi(4), s.powi(5));
        [
            1.0 - 10.0 * s3 + 15.0 * s4 - 6.0 * s5,
            self.frames * (s - 6.0 * s3 + 8.0 * s4 - 3.0 * s5),
        ]
    }
}

/// Axis times angle of the shorter turn.
fn rotation_vector(rotation: DQuat) -> DVec3 {
    let rotation = if rotation.w < 0.0 {
        -rotation
    } else {
        rotation
    };
    rotation.to_scaled_axis()
}

/// Of the two rotation vectors of one turn (the short way and the long way about) the one nearer to
/// `to`.
fn nearest(turn: DVec3, to: DVec3) -> DVec3 {
    let angle = turn.length();
    if angle < 1e-9 {
        return turn;
    }
    let other = turn * ((angle - TAU) / angle);
    if other.distance_squared(to) < turn.distance_squared(to) {
        other
    } else {
        turn
    }
}

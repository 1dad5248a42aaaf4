//! A window of T frames: what is given of it, and what was recorded.

use glam::{DQuat, DVec3};

use crate::models::transition::RootFrame;
use crate::motion::facing::FacingJoints;
use crate::motion::rotation_window::{Interpolation, between, nearer_sign};
use crate::motion::{Pose, Skeleton};

/// What is given of a window, in the frame of reference that a network sees: the root is measured
/// from its place at the first keyframe, turned as the config's `root_frame` says.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenWindow {
    /// T.
    pub frames: usize,
    /// Two keyframes or more by frame, the first at 0 and the last at T - 1: local rotations
    /// `[J]`, the first with w >= 0, each with the sign that is nearer to the keyframe before.
    pub keyframes: Vec<(usize, Vec<DQuat>)>,
    /// Place of the root at each keyframe, measured from that at the first, cm.
    pub roots: Vec<DVec3>,
    /// The frames before the first keyframe that are given, in the order of time.
    pub past: Vec<PastFrame>,
    /// Weights of the right and the left foot, `[T]`.
    pub contacts: Vec<[f64; 2]>,
    /// Translation of each joint in its parent's frame at the first keyframe, `[J]`, cm; the
    /// root's is 0.
    pub offsets: Vec<DVec3>,
    /// The root's place at the first keyframe in the world, cm.
    pub origin: DVec3,
    /// From the world's orientation to the network's.
    pub turn: DQuat,
}

/// A frame before the first keyframe, in the frame of reference of a [`GivenWindow`].
#[derive(Debug, Clone, PartialEq)]
pub struct PastFrame {
    /// Local rotations with the sign that is nearer to the frame after, `[J]`.
    pub rotations: Vec<DQuat>,
    /// The root measured from the first keyframe, cm.
    pub root: DVec3,
}

/// A recorded window in the frame of reference of a [`GivenWindow`].
#[derive(Debug, Clone, PartialEq)]
pub struct WindowTruth {
    /// Q, local rotations with the sign that is nearer to slerp between the keyframes, `[T][J]`.
    pub rotations: Vec<Vec<DQuat>>,
    /// R, `[T]`, cm, measured from the first keyframe.
    pub root: Vec<DVec3>,
}

impl GivenWindow {
    /// `keyframes`: poses by frame, two or more, ascending from 0; `contacts`: `[T]`.
    pub fn new(
        skeleton: &Skeleton,
        facing: &FacingJoints,
        root_frame: RootFrame,
        keyframes: &[(usize, &Pose)],
        contacts: Vec<[f64; 2]>,
    ) -> Self {
        let first = keyframes[0].1;
        let turn = match root_frame {
            RootFrame::KeyframeFacing => {
                let angle = facing.angle(&first.world_positions(skeleton));
                DQuat::from_rotation_y(-angle)
            }
            RootFrame::World | RootFrame::Keyframe => DQuat::IDENTITY,
        };
        let origin = first.translations[0];
        let mut offsets = first.translations.clone();
        offsets[0] = DVec3::ZERO;
        let mut before: Option<Vec<DQuat>> = None;
        let rotations = keyframes.iter().map(|(frame, pose)| {
            let mut rotations = turned(pose, turn);
            match &before {
                None => rotations
                    .iter_mut()
                    .filter(|q| q.w < 0.0)
                    .for_each(|q| *q = -*q),
                Some(before) => follow(&mut rotations, before),
            }
            before = Some(rotations.clone());
            (*frame, rotations)
        });
        Self {
            frames: contacts.len(),
            keyframes: rotations.collect(),
            roots: keyframes
                .iter()
                .map(|(_, pose)| turn * (pose.translations[0] - origin))
                .collect(),
            past: Vec::new(),
            contacts,
            offsets,
            origin,
            turn,
        }
    }

    /// The same window with the poses before its first keyframe, in the order of time.
    pub fn with_past(mut self, poses: &[&Pose]) -> Self {
        let mut after = self.keyframes[0].1.clone();
        let mut past: Vec<PastFrame> = Vec::new();
        for pose in poses.iter().rev() {
            let mut rotations = turned(pose, self.turn);
            follow(&mut rotations, &after);
            after.clone_from(&rotations);
            past.push(PastFrame {
                rotations,
                root: self.turn * (pose.translations[0] - self.origin),
            });
        }
        past.reverse();
        self.past = past;
        self
    }

    /// The two keyframes around a frame, and the share of the way between them.
    fn around(&self, frame: usize) -> (usize, usize, f64) {
        let after = self.keyframes.partition_point(|(at, _)| *at <= frame);
        let end = after.clamp(1, self.keyframes.len() - 1);
        let (from, to) = (self.keyframes[end - 1].0, self.keyframes[end].0);
        let share = (frame - from) as f64 / (to - from) as f64;
        (end - 1, end, share)
    }

    /// X_slerp: rotations between the keyframes, `[T][J]`.
    pub fn interpolated(&self, along: Interpolation) -> Vec<Vec<DQuat>> {
        let frames = 0..self.frames;
        frames
            .map(|frame| {
                let (from, to, share) = self.around(frame);
                between(&self.keyframes[from].1, &self.keyframes[to].1, share, along)
            })
            .collect()
    }

    /// The root on straight lines between the keyframes, `[T]`, cm.
    pub fn straight_root(&self) -> Vec<DVec3> {
        let frames = 0..self.frames;
        frames
            .map(|frame| {
                let (from, to, share) = self.around(frame);
                self.roots[from].lerp(self.roots[to], share)
            })
            .collect()
    }

    /// Frames to the nearer keyframe.
    pub fn distance(&self, frame: usize) -> usize {
        let distances = self.keyframes.iter().map(|(at, _)| at.abs_diff(frame));
        distances.min().unwrap_or(0)
    }

    /// The recorded frames `[T]` of this window.
    pub fn truth(&self, poses: &[Pose]) -> WindowTruth {
        let slerp = self.interpolated(Interpolation::Slerp);
        let rotations = poses.iter().zip(&slerp).map(|(pose, slerp)| {
            let mut rotations = turned(pose, self.turn);
            follow(&mut rotations, slerp);
            rotations
        });
        let root = poses.iter().map(|pose| pose.translations[0]);
        WindowTruth {
            rotations: rotations.collect(),
            root: root.map(|root| self.turn * (root - self.origin)).collect(),
        }
    }

    /// A frame of the network as a pose in the world: local rotations `[J]` of length 1, and the
    /// root measured from the first keyframe, cm.
    pub fn pose(&self, rotations: &[DQuat], root: DVec3) -> Pose {
        let back = self.turn.inverse();
        let mut translations = self.offsets.clone();
        translations[0] = self.origin + back * root;
        let mut rotations = rotations.to_vec();
        rotations[0] = back * rotations[0];
        Pose {
            translations,
            rotations,
        }
    }
}

/// Local rotations with the root's turned.
fn turned(pose: &Pose, turn: DQuat) -> Vec<DQuat> {
    let mut rotations = pose.rotations.clone();
    rotations[0] = turn * rotations[0];
    rotations
}

/// Gives each rotation the sign that is nearer to another.
fn follow(rotations: &mut [DQuat], others: &[DQuat]) {
    let pairs = rotations.iter_mut().zip(others);
    pairs.for_each(|(q, other)| *q = nearer_sign(*q, *other));
}

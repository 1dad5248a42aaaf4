//! A dance on the dance skeleton becomes the motion of the rig that its keyframes come from.

use glam::{DQuat, DVec3};

use crate::motion::{Clip, Pose, Skeleton};

/// A keyframe as the rig has it.
#[derive(Debug, Clone, PartialEq)]
pub struct RigKeyframe {
    /// Frame of the dance.
    pub time: usize,
    /// On the rig, in cm with Y up.
    pub pose: Pose,
    /// The same on the dance skeleton: a dance may have it elsewhere.
    pub mapped: Pose,
    /// Whether the dance passes through it, so that the motion is to have this very pose; else it
    /// tells of what the dance lacks alone.
    pub met: bool,
}

/// A rig, and what of it stands for the dance skeleton.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    pub skeleton: Skeleton,
    /// The joint of the dance skeleton whose rotation each joint has, `[joints]`.
    pub turned_as: Vec<Option<usize>>,
    /// The joint that stands for the hips.
    pub hips: Option<usize>,
    /// Whether a joint has a position of its own, `[joints]`.
    pub moves: Vec<bool>,
}

/// A dance on a rig: at the keyframes that it meets (at least one keyframe, by time) the rig's own
/// poses, whole; between them
///
/// - a joint that stands for one of the dance's has its world rotation, but for the difference that
///   there is at the keyframes, where bones stretch, say;
/// - every other joint (fingers, twist bones, props) goes from its place in its parent at one
///   keyframe to that at the next;
/// - the hips are where the dance's are. They move themselves where they have a position, else the
///   nearest joint above them that has one, or the root.
pub fn onto_rig(dance: &Clip, rig: &Rig, keyframes: &[RigKeyframe]) -> Clip {
    let anchors = keyframes.iter().map(|keyframe| rig.anchor(dance, keyframe));
    let anchors: Vec<Anchor> = anchors.collect();
    let frames = dance.poses.iter().enumerate();
    let poses = frames.map(|(frame, pose)| {
        let after = anchors.partition_point(|anchor| anchor.time <= frame);
        let before = after.saturating_sub(1);
        let (from, to) = (&anchors[before], anchors.get(after));
        let to = to.filter(|_| frame >= from.time).unwrap_or(from);
        let share = match to.time - from.time {
            0 => 0.0,
            frames => (frame - from.time) as f64 / frames as f64,
        };
        let (positions, rotations) = pose.world(&dance.skeleton);
        rig.pose(&positions, &rotations, &from.towards(to, share))
    });
    Clip {
        name: dance.name.clone(),
        skeleton: rig.skeleton.clone(),
        frame_time: dance.frame_time,
        poses: poses.collect(),
    }
}

/// The dance skeleton's root.
const HIPS: usize = 0;

/// What a keyframe says of the rig beside the dance.
#[derive(Clone)]
struct Anchor {
    time: usize,
    pose: Pose,
    /// From the world rotation of what a joint stands for to its own, `[joints]`.
    turns: Vec<DQuat>,
    /// From the dance's hips to the rig's, in the frame of the dance's, cm.
    hips: DVec3,
}

impl Anchor {
    fn towards(&self, other: &Self, share: f64) -> Self {
        let turns = self.turns.iter().zip(&other.turns);
        Self {
            time: self.time,
            pose: self.pose.towards(&other.pose, share),
            turns: turns
                .map(|(from, to)| from.slerp(*to, share).normalize())
                .collect(),
            hips: self.hips.lerp(other.hips, share),
        }
    }
}

impl Rig {
    /// The joint whose position moves the hips.
    pub fn carrier(&self) -> Option<usize> {
        let parent = |&joint: &usize| self.skeleton.joints[joint].parent;
        let mut above = std::iter::successors(self.hips, parent);
        let moving = above.find(|&joint| self.moves[joint]);
        moving.or_else(|| std::iter::successors(self.hips, parent).last())
    }

    fn anchor(&self, dance: &Clip, keyframe: &RigKeyframe) -> Anchor {
        let counterpart = match keyframe.met {
            true => &dance.poses[keyframe.time],
            false => &keyframe.mapped,
        };
        let (_, dance_rotations) = counterpart.world(&dance.skeleton);
        let (positions, rotations) = keyframe.pose.world(&self.skeleton);
        let turns = self.turned_as.iter().zip(&rotations);
        let turn = |(counterpart, own): (&Option<usize>, &DQuat)| {
            counterpart.map_or(DQuat::IDENTITY, |it| dance_rotations[it].inverse() * *own)
        };
        let mapped = &keyframe.mapped;
        let back = mapped.rotations[HIPS].inverse();
        let hips = self
            .hips
            .map(|hips| positions[hips] - mapped.translations[HIPS]);
        Anchor {
            time: keyframe.time,
            pose: keyframe.pose.clone(),
            turns: turns.map(turn).collect(),
            hips: back * hips.unwrap_or(DVec3::ZERO),
        }
    }

    /// One frame: `positions` and `rotations` are the dance's, in the world.
    fn pose(&self, positions: &[DVec3], rotations: &[DQuat], anchor: &Anchor) -> Pose {
        let mut pose = anchor.pose.clone();
        // Another dancer's keyframe on the rig is put onto this one's bones.
        for (index, joint) in self.skeleton.joints.iter().enumerate() {
            if !self.moves[index] && joint.parent.is_some() {
                pose.translations[index] = joint.offset;
            }
        }
        let mut world: Vec<DQuat> = Vec::with_capacity(self.skeleton.len());
        for (index, joint) in self.skeleton.joints.iter().enumerate() {
            let above = joint.parent.map_or(DQuat::IDENTITY, |parent| world[parent]);
            if let Some(counterpart) = self.turned_as[index] {
                let wanted = rotations[counterpart] * anchor.turns[index];
                pose.rotations[index] = (above.inverse() * wanted).normalize();
            }
            world.push((above * pose.rotations[index]).normalize());
        }
        if let Some((hips, carrier)) = self.hips.zip(self.carrier()) {
            let wanted = positions[HIPS] + rotations[HIPS] * anchor.hips;
            let there = pose.world_positions(&self.skeleton)[hips];
            let above = self.skeleton.joints[carrier].parent;
            let above = above.map_or(DQuat::IDENTITY, |parent| world[parent]);
            pose.translations[carrier] += above.inverse() * (wanted - there);
        }
        pose
    }
}

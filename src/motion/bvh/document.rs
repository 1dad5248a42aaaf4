//! What a BVH file says, with nothing dropped that bears on its motion.

use std::collections::HashSet;
use std::fmt;

use ndarray::Array2;

use super::error::BvhError;
use crate::motion::Skeleton;

/// How deep joints may nest; no body comes near it.
pub(super) const MAX_DEPTH: usize = 512;
/// Numbers beyond this are damage, not motion: 10 km in cm, thousands of turns in degrees.
pub(super) const LARGEST_NUMBER: f64 = 1e6;
/// The longest time from one frame to the next, s.
pub(super) const LONGEST_FRAME: f64 = 3600.0;
/// Joints for each channel, at most, so that a motion's memory stays in proportion to its file.
pub(super) const JOINTS_PER_CHANNEL: usize = 16;

/// One of the three axes of a joint's frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    /// 0, 1 or 2, as vectors are indexed.
    pub fn index(self) -> usize {
        self as usize
    }
}

/// One channel of a joint: a number that a motion row holds for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Replaces this part of the offset, cm.
    Position(Axis),
    /// Turns about this axis, degrees.
    Rotation(Axis),
}

impl Channel {
    pub(super) const NAMES: [(&'static str, Channel); 6] = [
        ("Xposition", Channel::Position(Axis::X)),
        ("Yposition", Channel::Position(Axis::Y)),
        ("Zposition", Channel::Position(Axis::Z)),
        ("Xrotation", Channel::Rotation(Axis::X)),
        ("Yrotation", Channel::Rotation(Axis::Y)),
        ("Zrotation", Channel::Rotation(Axis::Z)),
    ];
}

impl fmt::Display for Channel {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Self::NAMES
            .iter()
            .find(|(_, channel)| channel == self)
            .map_or("", |(name, _)| *name);
        formatter.write_str(name)
    }
}

/// A BVH document.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    pub(super) name: String,
    pub(super) skeleton: Skeleton,
    pub(super) channels: Vec<Vec<Channel>>,
    pub(super) frame_time: f64,
    pub(super) motion: Array2<f64>,
}

impl Bvh {
    /// A document from its parts; see the accessors for what they are.
    ///
    /// # Errors
    /// The parts do not fit each other, or a file with them would be refused by the reader.
    pub fn new(
        name: String,
        skeleton: Skeleton,
        channels: Vec<Vec<Channel>>,
        frame_time: f64,
        motion: Array2<f64>,
    ) -> Result<Self, BvhError> {
        let document = Self {
            name,
            skeleton,
            channels,
            frame_time,
            motion,
        };
        match document.fault() {
            Some(fault) => Err(BvhError::Document {
                name: document.name,
                fault,
            }),
            None => Ok(document),
        }
    }

    /// The file's name with its extension.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The hierarchy: names, offsets and End Sites. A joint without a parent is a ROOT.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    /// Channels of each joint in the order of its CHANNELS line, `[joints][0..=6]`.
    pub fn channels(&self) -> &[Vec<Channel>] {
        &self.channels
    }

    /// Seconds from one frame to the next, exactly as the file says.
    pub fn frame_time(&self) -> f64 {
        self.frame_time
    }

    /// Number of motion rows.
    pub fn frames(&self) -> usize {
        self.motion.nrows()
    }

    /// The motion rows, `[frames, channels of all joints]`, cm and degrees.
    pub fn motion(&self) -> &Array2<f64> {
        &self.motion
    }

    /// Index of each joint's first column in a motion row, `[joints]`.
    pub(super) fn first_columns(&self) -> Vec<usize> {
        let mut next = 0;
        self.channels
            .iter()
            .map(|channels| {
                next += channels.len();
                next - channels.len()
            })
            .collect()
    }

    fn fault(&self) -> Option<String> {
        self.hierarchy_fault()
            .or_else(|| self.channel_fault())
            .or_else(|| self.motion_fault())
    }

    fn hierarchy_fault(&self) -> Option<String> {
        let joints = &self.skeleton.joints;
        if joints.first().is_none_or(|joint| joint.parent.is_some()) {
            return Some("the hierarchy must begin with a root".into());
        }
        let mut names = HashSet::new();
        let mut depths: Vec<usize> = Vec::with_capacity(joints.len());
        for (index, joint) in joints.iter().enumerate() {
            let name = &joint.name;
            if !is_name(name) {
                return Some(format!(
                    "{name:?} is no joint name: it must be words without braces"
                ));
            }
            if !names.insert(name) {
                return Some(format!("two joints are named {name}"));
            }
            if joint.parent.is_some_and(|parent| parent >= index) {
                return Some(format!("joint {name} stands before its parent"));
            }
            let depth = joint.parent.map_or(1, |parent| depths[parent] + 1);
            if depth > MAX_DEPTH {
                return Some(format!(
                    "joint {name} is nested deeper than {MAX_DEPTH} joints"
                ));
            }
            depths.push(depth);
            let mut offsets = joint
                .end_sites
                .iter()
                .chain([&joint.offset])
                .flat_map(|offset| offset.to_array());
            if !offsets.all(is_sound) {
                return Some(format!(
                    "joint {name} has an offset beyond {LARGEST_NUMBER} or not a number"
                ));
            }
        }
        None
    }

    fn channel_fault(&self) -> Option<String> {
        let joints = &self.skeleton.joints;
        if self.channels.len() != joints.len() {
            return Some(format!(
                "{} joints have {} lists of channels",
                joints.len(),
                self.channels.len()
            ));
        }
        for (joint, channels) in joints.iter().zip(&self.channels) {
            let distinct: HashSet<&Channel> = channels.iter().collect();
            if distinct.len() != channels.len() {
                return Some(format!("joint {} has a channel twice", joint.name));
            }
        }
        let total: usize = self.channels.iter().map(Vec::len).sum();
        if total * JOINTS_PER_CHANNEL < joints.len() {
            return Some(format!(
                "{} joints have {total} channels between them",
                joints.len()
            ));
        }
        if self.motion.ncols() != total {
            return Some(format!(
                "the joints have {total} channels, the motion rows {} numbers",
                self.motion.ncols()
            ));
        }
        None
    }

    fn motion_fault(&self) -> Option<String> {
        if self.motion.nrows() == 0 {
            return Some("there are no frames".into());
        }
        if !(self.frame_time > 0.0 && self.frame_time <= LONGEST_FRAME) {
            return Some(format!(
                "frame time {} s is not above 0 and at most {LONGEST_FRAME} s",
                self.frame_time
            ));
        }
        self.motion
            .rows()
            .into_iter()
            .position(|row| !row.iter().copied().all(is_sound))
            .map(|frame| {
                format!("frame {frame} holds a number beyond {LARGEST_NUMBER} or none at all")
            })
    }
}

/// Whether the reader takes a text as a joint's name: words with one space between them, no braces.
pub(super) fn is_name(text: &str) -> bool {
    let banned = |letter: char| letter == '{' || letter == '}' || letter.is_control();
    !text.is_empty() && !text.contains(banned) && text.split_whitespace().eq(text.split(' '))
}

pub(super) fn is_sound(number: f64) -> bool {
    number.abs() <= LARGEST_NUMBER
}

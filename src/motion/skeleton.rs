//! The hierarchy of a body: names, parents, rest offsets.

use glam::DVec3;

/// Number of joints of the dance skeleton, root included (J = 24 in the papers' notation).
pub const JOINTS: usize = 24;

/// The joints of the dance skeleton, in the order of every feature vector.
pub const DANCE_JOINTS: [&str; JOINTS] = [
    "Hips",
    "LeftUpLeg",
    "LeftLeg",
    "LeftFoot",
    "LeftToeBase",
    "RightUpLeg",
    "RightLeg",
    "RightFoot",
    "RightToeBase",
    "Spine",
    "Spine1",
    "Spine2",
    "Spine3",
    "Spine4",
    "RightShoulder",
    "RightArm",
    "RightForeArm",
    "RightHand",
    "LeftShoulder",
    "LeftArm",
    "LeftForeArm",
    "LeftHand",
    "Neck",
    "Head",
];

/// Parent of each joint of the dance skeleton; the root has none.
pub const DANCE_PARENTS: [Option<usize>; JOINTS] = [
    None,
    Some(0),
    Some(1),
    Some(2),
    Some(3),
    Some(0),
    Some(5),
    Some(6),
    Some(7),
    Some(0),
    Some(9),
    Some(10),
    Some(11),
    Some(12),
    Some(13),
    Some(14),
    Some(15),
    Some(16),
    Some(13),
    Some(18),
    Some(19),
    Some(20),
    Some(13),
    Some(22),
];

/// One joint: its name, its parent (always earlier in the skeleton) and where it sits in the
/// parent's frame at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    pub name: String,
    pub parent: Option<usize>,
    /// Offset from the parent at rest, cm.
    pub offset: DVec3,
    /// Offsets of the End Sites that hang on this joint, cm.
    pub end_sites: Vec<DVec3>,
}

/// A hierarchy of joints; the first is the root, and a parent stands before its children.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    pub joints: Vec<Joint>,
}

impl Skeleton {
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Index of the joint with this name.
    pub fn index_of(&self, name: &str) -> Option<usize> {
        self.joints.iter().position(|joint| joint.name == name)
    }

    /// Whether the joints are the 24 of the dance skeleton, in its order and with its parents.
    pub fn is_dance_skeleton(&self) -> bool {
        self.difference_from_dance().is_none()
    }

    /// The first place where this is not the dance skeleton: its index, what the dance skeleton has
    /// there, what this one has.
    pub fn difference_from_dance(&self) -> Option<(usize, String, String)> {
        let name_at = |at: usize| self.joints.get(at).map(|joint| joint.name.as_str());
        (0..self.len().max(JOINTS)).find_map(|index| {
            let expected = DANCE_JOINTS
                .get(index)
                .map(|name| describe(name, DANCE_PARENTS[index].map(|at| DANCE_JOINTS[at])));
            let joint = self.joints.get(index);
            let found = joint.map(|joint| describe(&joint.name, joint.parent.and_then(name_at)));
            let text = |joint: Option<String>| joint.unwrap_or("no further joint".into());
            (expected != found).then(|| (index, text(expected), text(found)))
        })
    }
}

/// "LeftLeg on LeftUpLeg", or the name alone of a joint without a parent.
fn describe(name: &str, parent: Option<&str>) -> String {
    match parent {
        Some(parent) => format!("{name} on {parent}"),
        None => name.to_string(),
    }
}

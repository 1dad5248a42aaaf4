//! The skeleton of a page's dancers.

use serde::Serialize;

use crate::motion::skeleton::{DANCE_JOINTS, DANCE_PARENTS};
use crate::motion::{Feet, Skeleton};
use crate::report::dancer::bone_thickness;

/// What a page draws of a skeleton.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewerBody {
    /// -1 for the root.
    parents: Vec<i32>,
    /// The joint that carries the head.
    head: Option<usize>,
    /// The joints that are marked where they stand: left ankle and toe, right ankle and toe; none
    /// where the names do not tell them.
    feet: Vec<usize>,
    /// Thickness of the bone that ends at each joint, cm.
    thickness: Vec<f64>,
}

impl ViewerBody {
    /// That of the dance skeleton.
    pub fn dance() -> Self {
        let feet = crate::motion::contact::FOOT_JOINTS.to_vec();
        Self::named(DANCE_JOINTS.into_iter().zip(DANCE_PARENTS), feet)
    }

    /// That of any skeleton, its head, its feet and its thickness by the joints' names.
    pub fn of(skeleton: &Skeleton) -> Self {
        let joints = skeleton.joints.iter();
        let feet = Feet::of(skeleton).map_or(Vec::new(), |Feet { ankles, toes }| {
            vec![ankles[1], toes[1], ankles[0], toes[0]]
        });
        let joints = joints.map(|joint| (joint.name.as_str(), joint.parent));
        Self::named(joints, feet)
    }

    fn named<'n>(
        joints: impl Iterator<Item = (&'n str, Option<usize>)> + Clone,
        feet: Vec<usize>,
    ) -> Self {
        let parent = |parent: Option<usize>| parent.map_or(-1, |parent| parent as i32);
        let names = || joints.clone().map(|(name, _)| name);
        Self {
            parents: joints.clone().map(|(_, it)| parent(it)).collect(),
            head: names().position(|name| name == "Head"),
            feet,
            thickness: names().map(bone_thickness).collect(),
        }
    }

    pub(super) fn joints(&self) -> usize {
        self.parents.len()
    }
}

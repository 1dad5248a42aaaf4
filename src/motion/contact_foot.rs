//! The foot in contact, one a frame: the contact label of Li et al. (section 3.1), left or right
//! and nothing else, so that the root can be reconstructed from it
//! ([`super::root_reconstruction`]).

use glam::DVec3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::skeleton::Skeleton;

/// A foot, in the order of the label's two numbers: right [1, 0], left [0, 1].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Foot {
    Right,
    Left,
}

impl Foot {
    /// Its place in a label.
    pub fn index(self) -> usize {
        match self {
            Self::Right => 0,
            Self::Left => 1,
        }
    }

    /// The foot at a place in a label, the left one at any but 0.
    pub fn at(index: u8) -> Self {
        match index {
            0 => Self::Right,
            _ => Self::Left,
        }
    }

    /// Its label.
    pub fn one_hot(self) -> [f64; 2] {
        match self {
            Self::Right => [1.0, 0.0],
            Self::Left => [0.0, 1.0],
        }
    }

    /// The foot that two numbers, right and left, say more of; left where they are equal.
    pub fn larger([right, left]: [f64; 2]) -> Self {
        match right > left {
            true => Self::Right,
            false => Self::Left,
        }
    }
}

/// How a recorded frame's foot in contact is told.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ContactRule {
    /// The foot whose ankle is lower; equal heights: left.
    #[default]
    LowerAnkle,
    /// The foot whose toe moves less to the next frame; equal: left. The last frame repeats the
    /// label before it.
    SlowerToe,
    /// While both toes move less than the contact threshold allows, a foot that is drawn once and
    /// held (section 4.6); else the lower ankle.
    RandomWhenBoth,
}

/// The foot joints of a skeleton, right and left.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Feet {
    pub ankles: [usize; 2],
    pub toes: [usize; 2],
}

/// A skeleton without a joint that a rule needs.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "the skeleton of {joints} joints has none called {missing}; map the clip to one that does, or \
     rename the joint"
)]
pub struct MissingJoint {
    pub joints: usize,
    /// The names that would do.
    pub missing: String,
}

/// The index of the joint that has one of these names.
///
/// # Errors
/// There is none.
pub fn joint_called(skeleton: &Skeleton, names: &[&str]) -> Result<usize, MissingJoint> {
    let found = names.iter().find_map(|name| skeleton.index_of(name));
    found.ok_or_else(|| MissingJoint {
        joints: skeleton.len(),
        missing: names.join(" or "),
    })
}

impl Feet {
    /// The feet of a skeleton by their names: `RightFoot`, `LeftFoot`, and `RightToe` and `LeftToe`
    /// or `RightToeBase` and `LeftToeBase`.
    ///
    /// # Errors
    /// A joint is missing.
    pub fn of(skeleton: &Skeleton) -> Result<Self, MissingJoint> {
        let joint = |names: &[&str]| joint_called(skeleton, names);
        Ok(Self {
            ankles: [joint(&["RightFoot"])?, joint(&["LeftFoot"])?],
            toes: [
                joint(&["RightToe", "RightToeBase"])?,
                joint(&["LeftToe", "LeftToeBase"])?,
            ],
        })
    }
}

impl ContactRule {
    /// The joints that stand still while a foot is in contact, right and left.
    pub fn joints(self, feet: &Feet) -> [usize; 2] {
        match self {
            Self::LowerAnkle | Self::RandomWhenBoth => feet.ankles,
            Self::SlowerToe => feet.toes,
        }
    }

    /// The foot in contact in every frame, `[frames]`.
    ///
    /// `world`: world positions of the joints, `[frames][joints]`, cm; `threshold`: squared speed
    /// below which a toe stands, (cm/frame)^2; `draw` gives a foot for each contact of both.
    pub fn labels(
        self,
        world: &[Vec<DVec3>],
        feet: &Feet,
        threshold: f64,
        mut draw: impl FnMut() -> Foot,
    ) -> Vec<Foot> {
        let lower = |joints: &Vec<DVec3>| {
            let [right, left] = feet.ankles.map(|joint| joints[joint].y);
            Foot::larger([-right, -left])
        };
        match self {
            Self::LowerAnkle => world.iter().map(lower).collect(),
            Self::SlowerToe => {
                let speeds = toe_speeds(world, feet).into_iter();
                let mut labels: Vec<Foot> = speeds
                    .map(|[right, left]| Foot::larger([-right, -left]))
                    .collect();
                let last = labels.last().copied().or(world.last().map(lower));
                labels.extend(last);
                labels
            }
            Self::RandomWhenBoth => {
                let mut speeds = toe_speeds(world, feet);
                speeds.extend(speeds.last().copied());
                let mut held = None;
                let frames = world.iter().enumerate();
                frames
                    .map(|(time, joints)| {
                        let speeds = speeds.get(time);
                        let both = speeds.is_some_and(|it| it.iter().all(|&v| v < threshold));
                        held = both.then(|| held.unwrap_or_else(&mut draw));
                        held.unwrap_or_else(|| lower(joints))
                    })
                    .collect()
            }
        }
    }
}

/// Squared speeds of both toes from each frame to the next, `[frames - 1]`, (cm/frame)^2.
fn toe_speeds(world: &[Vec<DVec3>], feet: &Feet) -> Vec<[f64; 2]> {
    let speeds = world.windows(2);
    speeds
        .map(|pair| {
            feet.toes
                .map(|toe| pair[1][toe].distance_squared(pair[0][toe]))
        })
        .collect()
}

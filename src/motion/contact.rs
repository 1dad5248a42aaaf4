//! Foot contacts: a foot joint that hardly moves in the world stands on the ground.

use glam::DVec3;
use ndarray::ArrayView1;

use super::features::CONTACTS;

/// The foot joints of the dance skeleton, in the order of the labels: LeftFoot, LeftToeBase,
/// RightFoot, RightToeBase.
pub const FOOT_JOINTS: [usize; 4] = [3, 4, 7, 8];

/// A foot joint is in contact where its label is above this.
pub const CONTACT_LABEL: f64 = 0.5;

/// Which foot joints are in contact by the labels of a frame, in the order of [`FOOT_JOINTS`].
///
/// `frame`: the 149 numbers of a predicted frame or the 154 of a recorded one, not standardised.
/// Panics on fewer than 77 numbers.
pub fn in_contact(frame: ArrayView1<f64>) -> [bool; 4] {
    std::array::from_fn(|foot| frame[CONTACTS.start + foot] > CONTACT_LABEL)
}

/// Contact labels of every frame, `[frames][feet]`: 1 where the squared world-space speed is below
/// `threshold` ((cm/frame)^2).
///
/// `world`: world positions of a skeleton's joints, `[frames][joints]`, cm; `feet`: which of them
/// are foot joints, such as [`FOOT_JOINTS`].
///
/// The speed of frame t is that from t - 1 to t; the first frame has the labels of the second, and
/// a clip of one frame counts as standing. World space, because relative to the root a planted foot
/// of a moving dancer looks like a moving one.
pub fn contacts<const FEET: usize>(
    world: &[Vec<DVec3>],
    feet: [usize; FEET],
    threshold: f64,
) -> Vec<[f64; FEET]> {
    let mut labels: Vec<[f64; FEET]> = world
        .windows(2)
        .map(|pair| {
            feet.map(|joint| {
                let squared_speed = (pair[1][joint] - pair[0][joint]).length_squared();
                if squared_speed < threshold { 1.0 } else { 0.0 }
            })
        })
        .collect();
    labels.insert(0, labels.first().copied().unwrap_or([1.0; FEET]));
    labels
}

/// Foot skate: the mean distance (cm/frame) that a foot joint moves in the world from the frame
/// before to one in which it is in contact. None where no joint is.
///
/// `world`: world positions of a skeleton's joints, `[frames][joints]`, cm; `feet`: which of them
/// are foot joints; `contacts`: `[frames]` in their order.
pub fn foot_skate<const FEET: usize>(
    world: &[Vec<DVec3>],
    feet: [usize; FEET],
    contacts: &[[bool; FEET]],
) -> Option<f64> {
    foot_travel(world, feet, contacts).mean()
}

/// What [`foot_skate`] is the mean of.
pub fn foot_travel<const FEET: usize>(
    world: &[Vec<DVec3>],
    feet: [usize; FEET],
    contacts: &[[bool; FEET]],
) -> FootTravel {
    let mut travel = FootTravel::default();
    for (pair, contacts) in world.windows(2).zip(contacts.iter().skip(1)) {
        for (joint, _) in feet.iter().zip(contacts).filter(|(_, on)| **on) {
            travel.step(pair[0][*joint], pair[1][*joint]);
        }
    }
    travel
}

/// How far feet have moved, and in how many steps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FootTravel {
    /// cm.
    pub distance: f64,
    /// Number of feet and frames.
    pub steps: usize,
}

impl FootTravel {
    /// A foot has gone from one place (cm) to another from a frame to the next.
    pub fn step(&mut self, from: DVec3, to: DVec3) {
        self.distance += to.distance(from);
        self.steps += 1;
    }

    /// What several have moved together.
    pub fn add(&mut self, other: Self) {
        self.distance += other.distance;
        self.steps += other.steps;
    }

    /// The mean step, cm/frame; none where there was none.
    pub fn mean(&self) -> Option<f64> {
        (self.steps > 0).then(|| self.distance / self.steps as f64)
    }
}

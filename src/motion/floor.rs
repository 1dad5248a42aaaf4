//! The floor under a dancer, told by how low the feet come.

use glam::DVec3;

use super::contact::FootTravel;
use super::contact_foot::Feet;

/// A foot joint that is less than this above its floor is on it, cm.
pub const ON_FLOOR: f64 = 3.0;

/// The heights of the foot joints of a dancer who stands on the floor, cm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    pub ankle: f64,
    pub toe: f64,
}

impl Floor {
    /// The lowest that ankles and toes come in a motion.
    ///
    /// `world`: world positions of a skeleton's joints, `[frames][joints]`, cm; `feet`: which of
    /// them are the feet's. Without frames the floor is nowhere: infinitely high.
    pub fn under(world: &[Vec<DVec3>], feet: &Feet) -> Self {
        let lowest = |joints: [usize; 2]| {
            let heights = world.iter().flat_map(|it| joints.map(|joint| it[joint].y));
            heights.fold(f64::INFINITY, f64::min)
        };
        Self {
            ankle: lowest(feet.ankles),
            toe: lowest(feet.toes),
        }
    }

    /// The floor of a dancer who mostly stands on it: the lowest ankle and the lowest toe of the
    /// frame in the middle, by height; lower ones may have been measured wrong. As
    /// [`Floor::under`].
    pub fn usual(world: &[Vec<DVec3>], feet: &Feet) -> Self {
        let middle = |joints: [usize; 2]| {
            let lowest = |frame: &Vec<DVec3>| frame[joints[0]].y.min(frame[joints[1]].y);
            let mut heights: Vec<f64> = world.iter().map(lowest).collect();
            heights.sort_by(f64::total_cmp);
            heights.get(heights.len() / 2).copied()
        };
        Self {
            ankle: middle(feet.ankles).unwrap_or(f64::INFINITY),
            toe: middle(feet.toes).unwrap_or(f64::INFINITY),
        }
    }

    /// The lower of two floors.
    #[must_use]
    pub fn or_lower(self, other: Self) -> Self {
        Self {
            ankle: self.ankle.min(other.ankle),
            toe: self.toe.min(other.toe),
        }
    }

    /// Foot skate whatever the contact labels: how far toes have moved in the world from the frame
    /// before to one in which they are on the floor. `world` and `feet` as in [`Floor::under`].
    pub fn toe_travel(&self, world: &[Vec<DVec3>], feet: &Feet) -> FootTravel {
        let mut travel = FootTravel::default();
        for pair in world.windows(2) {
            for joint in feet.toes {
                let (from, to) = (pair[0][joint], pair[1][joint]);
                if to.y < self.toe + ON_FLOOR {
                    travel.step(from, to);
                }
            }
        }
        travel
    }

    /// The height of the lowest toe above the floor, cm; below 0: it goes through it.
    pub fn lowest_toe(&self, world: &[Vec<DVec3>], feet: &Feet) -> f64 {
        Self::under(world, feet).toe - self.toe
    }
}

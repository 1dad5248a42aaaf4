//! A leg that brings its ankle and toe elsewhere: two-bone inverse kinematics that keeps the knee's
//! direction, and a foot that turns.

use glam::{DQuat, DVec3};

use super::knee::Knee;
use crate::motion::ik::two_bone;
use crate::motion::{Pose, Skeleton};

/// From this share of its length on a leg is stretched less than a place asks: before it is
/// straight its knee snaps.
const SOFT: f64 = 0.97;
/// A level foot turns upwards about the ankle by at most this before the ankle is lifted instead,
/// rad; a steeper one by less, one that points straight down not at all.
const PITCH: f64 = 0.4;
/// Corrections below this are none, cm.
const STILL: f64 = 1e-9;
/// Bones below this have no direction, cm.
const SHORTEST_BONE: f64 = 1e-6;

/// The joints of a leg.
#[derive(Debug, Clone, Copy)]
pub(super) struct Leg {
    pub hip: usize,
    pub knee: usize,
    pub ankle: usize,
    pub toe: usize,
}

impl Leg {
    /// The leg with this ankle and toe, where the skeleton has one.
    pub fn of(skeleton: &Skeleton, ankle: usize, toe: usize) -> Option<Self> {
        let knee = skeleton.joints[ankle].parent?;
        let hip = skeleton.joints[knee].parent?;
        Some(Self {
            hip,
            knee,
            ankle,
            toe,
        })
    }

    /// Moves the ankle; the foot keeps its direction in the world. `knee` is where the knee of this
    /// frame points.
    pub fn move_ankle(&self, skeleton: &Skeleton, pose: &mut Pose, moved: DVec3, knee: &Knee) {
        if moved.length() <= STILL {
            return;
        }
        let (positions, rotations) = pose.world(skeleton);
        let upper = positions[self.knee] - positions[self.hip];
        let lower = positions[self.ankle] - positions[self.knee];
        let [long, short] = [upper.length(), lower.length()];
        if long < SHORTEST_BONE || short < SHORTEST_BONE {
            return;
        }
        let to_place = positions[self.ankle] + moved - positions[self.hip];
        let now = positions[self.ankle].distance(positions[self.hip]);
        let reach = soft_reach(to_place.length(), now, long + short);
        let target = reach * to_place.normalize_or_zero();
        let stands_out = |reach: f64| {
            let along = (reach * reach + long * long - short * short) / (2.0 * reach);
            (long * long - along * along).max(0.0).sqrt()
        };
        let pole = knee.pole(target, stands_out(now), stands_out(reach));
        let hip = positions[self.hip];
        let limb = two_bone(hip, hip + target, long, short, pole);
        let arc =
            |from: DVec3, to: DVec3| DQuat::from_rotation_arc(from.normalize(), to.normalize());
        let swing = arc(upper, limb.middle - hip);
        let thigh = swing * rotations[self.hip];
        let shin = arc(swing * lower, limb.end - limb.middle) * swing * rotations[self.knee];
        let parent = skeleton.joints[self.hip]
            .parent
            .map_or(DQuat::IDENTITY, |parent| rotations[parent]);
        pose.rotations[self.hip] = (parent.inverse() * thigh).normalize();
        pose.rotations[self.knee] = (thigh.inverse() * shin).normalize();
        pose.rotations[self.ankle] = (shin.inverse() * rotations[self.ankle]).normalize();
    }

    /// How far the ankle must rise beyond `moved` so that its toe comes to `floor` by a small turn
    /// of the foot, cm.
    pub fn rise(&self, world: &[DVec3], moved: DVec3, floor: f64) -> f64 {
        let foot = world[self.toe] - world[self.ankle];
        let lacking = floor - world[self.toe].y - moved.y;
        let pitch = (foot.y / foot.length()).clamp(-1.0, 1.0).asin();
        let turned = (pitch + PITCH * pitch.cos()).sin() - pitch.sin();
        match pitch.is_finite() {
            true => (lacking - turned * foot.length()).max(0.0),
            false => lacking.max(0.0),
        }
    }

    /// Turns the foot so that its toe points at `place` as much as `share` says, 0 to 1, and is not
    /// below the floor.
    pub fn aim_foot(
        &self,
        skeleton: &Skeleton,
        pose: &mut Pose,
        (place, share): (DVec3, f64),
        floor: f64,
    ) {
        let (positions, rotations) = pose.world(skeleton);
        let now = positions[self.toe] - positions[self.ankle];
        let wanted = positions[self.toe].lerp(place, share) - positions[self.ankle];
        let length = now.length();
        if length < SHORTEST_BONE || wanted.length() < SHORTEST_BONE {
            return;
        }
        let height = floor - positions[self.ankle].y;
        let wanted = not_below(length * wanted.normalize(), height);
        if wanted.distance(now) > STILL {
            let turn = DQuat::from_rotation_arc(now.normalize(), wanted.normalize());
            let ankle = turn * rotations[self.ankle];
            pose.rotations[self.ankle] = (rotations[self.knee].inverse() * ankle).normalize();
        }
    }
}

/// How far from the hip an ankle comes that wants to be so far and is `now`: as far as it is at
/// least, and never quite as far as the leg is long.
fn soft_reach(wanted: f64, now: f64, length: f64) -> f64 {
    let (soft, room) = (SOFT * length, (1.0 - SOFT) * length);
    let eased = match wanted > soft {
        true => soft + room * (1.0 - (-(wanted - soft) / room).exp()),
        false => wanted,
    };
    eased.max(wanted.min(now))
}

/// A bone of the same length whose end is not below a height, both from its begin; straight up
/// where it is too short for that.
fn not_below(bone: DVec3, height: f64) -> DVec3 {
    let length = bone.length();
    if bone.y >= height {
        return bone;
    }
    let y = height.min(length);
    let along = (length * length - y * y).max(0.0).sqrt();
    let level = DVec3::new(bone.x, 0.0, bone.z).normalize_or(DVec3::Z);
    along * level + y * DVec3::Y
}

//! Inverse kinematics of a limb of two bones, in closed form.

use glam::{DMat3, DQuat, DVec3};

/// Lengths below this (cm) have no direction.
const SHORTEST: f64 = 1e-9;

/// Where the joints of a two-bone limb stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoBone {
    /// Knee or elbow, cm.
    pub middle: DVec3,
    /// Ankle or wrist, cm: the target itself where it is within reach.
    pub end: DVec3,
    /// Whether the target lies between the shortest and the longest reach of the limb.
    pub reached: bool,
}

/// Places the middle joint of a limb so that its end meets `target`.
///
/// `root` (hip or shoulder) and `target` are positions in cm; `upper` and `lower` are the bone
/// lengths, cm; the middle joint bends towards `pole`, a direction of any length. The bone lengths
/// are held whatever the target: out of reach, the limb points at the target as far (or as near) as
/// it goes. With a pole along the limb, or a target on the root, any bend that holds the lengths is
/// returned.
pub fn two_bone(root: DVec3, target: DVec3, upper: f64, lower: f64, pole: DVec3) -> TwoBone {
    let offset = target - root;
    let length = offset.length();
    let pole = pole.try_normalize().unwrap_or(DVec3::Z);
    let direction = if length > SHORTEST {
        offset / length
    } else {
        pole.any_orthonormal_vector()
    };
    let (nearest, farthest) = ((upper - lower).abs(), upper + lower);
    let reached = (nearest..=farthest).contains(&length);
    let distance = length.clamp(nearest, farthest);
    let end = if reached {
        target
    } else {
        root + distance * direction
    };
    let bend = across(pole, direction);
    // Law of cosines: where the middle joint stands along the limb, and how far it stands out.
    let along = if distance > SHORTEST {
        (distance * distance + upper * upper - lower * lower) / (2.0 * distance)
    } else {
        0.0
    };
    let out = (upper * upper - along * along).max(0.0).sqrt();
    let middle = root + along * direction + out * bend;
    TwoBone {
        middle,
        end,
        reached,
    }
}

/// The rotation that takes the direction `rest` to `direction`, and `rest_pole` as near to `pole`
/// as that allows.
///
/// Directions of any length; where a pole is along its direction, any perpendicular one stands in.
pub fn aim(rest: DVec3, rest_pole: DVec3, direction: DVec3, pole: DVec3) -> DQuat {
    let frame = |direction: DVec3, pole: DVec3| {
        let first = direction.try_normalize().unwrap_or(DVec3::NEG_Y);
        let second = across(pole, first);
        DMat3::from_cols(first, second, first.cross(second))
    };
    let turn = frame(direction, pole) * frame(rest, rest_pole).transpose();
    DQuat::from_mat3(&turn).normalize()
}

/// The unit vector across `direction` (of length 1) that is nearest to `pole`.
fn across(pole: DVec3, direction: DVec3) -> DVec3 {
    (pole - pole.dot(direction) * direction)
        .try_normalize()
        .filter(|bend| bend.dot(direction).abs() < 1e-6)
        .unwrap_or_else(|| direction.any_orthonormal_vector())
}

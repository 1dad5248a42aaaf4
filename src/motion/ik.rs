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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn vector(size: f64) -> impl Strategy<Value = DVec3> {
        (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| DVec3::new(x, y, z))
    }

    fn unit() -> impl Strategy<Value = DVec3> {
        vector(1.0)
            .prop_filter("needs a direction", |v| v.length() > 0.1)
            .prop_map(|v| v.normalize())
    }

    proptest! {
        #[test]
        fn a_target_within_reach_is_met_and_bends_towards_the_pole(
            root in vector(200.0), direction in unit(), pole in unit(),
            upper in 10.0..60.0f64, lower in 10.0..60.0f64, share in 0.01..0.999f64,
        ) {
            let nearest = (upper - lower).abs();
            let target = root + direction * (nearest + share * (upper + lower - nearest));
            let limb = two_bone(root, target, upper, lower, pole);
            prop_assert!(limb.reached);
            prop_assert!(limb.end.distance(target) < 1e-9);
            prop_assert!((limb.middle.distance(root) - upper).abs() < 1e-9);
            prop_assert!((limb.end.distance(limb.middle) - lower).abs() < 1e-9);
            prop_assume!(pole.cross(direction).length() > 1e-3);
            prop_assert!((limb.middle - root).dot(across(pole, direction)) > 0.0);
        }

        #[test]
        fn out_of_reach_the_limb_points_at_the_target_with_its_lengths_held(
            root in vector(200.0), direction in unit(), pole in unit(),
            upper in 10.0..60.0f64, lower in 10.0..60.0f64, beyond in 0.01..50.0f64,
        ) {
            let target = root + direction * (upper + lower + beyond);
            let limb = two_bone(root, target, upper, lower, pole);
            prop_assert!(!limb.reached);
            prop_assert!((limb.middle.distance(root) - upper).abs() < 1e-9);
            prop_assert!((limb.end.distance(limb.middle) - lower).abs() < 1e-9);
            prop_assert!((limb.end - root).normalize().distance(direction) < 1e-9);
            prop_assert!((limb.end.distance(target) - beyond).abs() < 1e-9);
        }

        #[test]
        fn a_target_too_near_is_approached_with_the_lengths_held(
            root in vector(200.0), direction in unit(), pole in unit(),
            lower in 10.0..30.0f64, more in 5.0..30.0f64, share in 0.0..0.99f64,
        ) {
            let upper = lower + more;
            let target = root + direction * (share * more);
            let limb = two_bone(root, target, upper, lower, pole);
            prop_assert!(!limb.reached);
            prop_assert!((limb.middle.distance(root) - upper).abs() < 1e-9);
            prop_assert!((limb.end.distance(limb.middle) - lower).abs() < 1e-9);
            prop_assert!((limb.end.distance(root) - more).abs() < 1e-9);
        }

        #[test]
        fn aim_takes_the_rest_direction_to_the_direction_and_turns_the_pole_to_its_side(
            rest in unit(), rest_pole in unit(), direction in unit(), pole in unit(),
        ) {
            prop_assume!(rest.cross(rest_pole).length() > 0.05);
            prop_assume!(direction.cross(pole).length() > 0.05);
            let rotation = aim(rest, rest_pole, direction, pole);
            prop_assert!((rotation * rest).distance(direction) < 1e-9);
            let turned = rotation * across(rest_pole, rest);
            prop_assert!(turned.distance(across(pole, direction)) < 1e-9);
        }
    }

    #[test]
    fn equal_bones_fold_onto_their_root() {
        let limb = two_bone(DVec3::ZERO, DVec3::ZERO, 40.0, 40.0, DVec3::Z);
        assert!(limb.reached);
        assert!((limb.middle.length() - 40.0).abs() < 1e-9);
        assert!(limb.end.length() < 1e-9);
    }
}

//! Inverse kinematics of a limb of two bones.

use glam::DVec3;
use keydance::motion::ik::{aim, two_bone};
use proptest::prelude::*;

fn vector(size: f64) -> impl Strategy<Value = DVec3> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| DVec3::new(x, y, z))
}

fn unit() -> impl Strategy<Value = DVec3> {
    vector(1.0)
        .prop_filter("needs a direction", |v| v.length() > 0.1)
        .prop_map(|v| v.normalize())
}

/// The unit vector across `direction`, of length 1, that is nearest to `pole`.
fn across(pole: DVec3, direction: DVec3) -> DVec3 {
    (pole - pole.dot(direction) * direction).normalize()
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

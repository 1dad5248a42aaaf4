//! The rotation that fits pairs of directions best.

use glam::{DQuat, DVec3};
use keydance::motion::rotation_fit::best_rotation;
use proptest::prelude::*;

fn vector() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-10.0..10.0f64)
        .prop_map(DVec3::from)
        .prop_filter("not at the origin", |v| v.length() > 0.1)
}

fn rotation() -> impl Strategy<Value = DQuat> {
    prop::array::uniform4(-1.0..1.0f64)
        .prop_filter("a direction", |q| {
            q.iter().map(|x| x * x).sum::<f64>() > 0.01
        })
        .prop_map(|q| DQuat::from_array(q).normalize())
}

fn error(rotation: DQuat, pairs: &[(DVec3, DVec3)]) -> f64 {
    pairs
        .iter()
        .map(|(a, b)| (rotation * *a).distance_squared(*b))
        .sum()
}

proptest! {
    #[test]
    fn a_rotation_is_found_again(true_rotation in rotation(), from in prop::collection::vec(vector(), 1..5)) {
        let pairs: Vec<_> = from.iter().map(|a| (*a, true_rotation * *a)).collect();
        prop_assert!(error(best_rotation(&pairs), &pairs) < 1e-12 * pairs.len() as f64 * 1000.0);
    }

    #[test]
    fn no_other_rotation_fits_better(pairs in prop::collection::vec((vector(), vector()), 2..5), other in rotation(), share in 0.0..1.0f64) {
        let best = best_rotation(&pairs);
        for rival in [other, best.slerp(other, 0.05 * share)] {
            prop_assert!(error(best, &pairs) <= error(rival, &pairs) + 1e-9);
        }
    }
}

#[test]
fn opposite_directions_are_half_a_turn() {
    let turned = best_rotation(&[(DVec3::X, -DVec3::X)]) * DVec3::X;
    assert!(turned.distance(-DVec3::X) < 1e-12, "{turned}");
}

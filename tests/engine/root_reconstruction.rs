//! The root from the foot in contact.

use glam::DVec3;
use keydance::motion::root_reconstruction::reconstruct_root;
use proptest::prelude::*;

#[test]
fn the_root_goes_against_the_weighted_steps_of_the_feet() {
    // Relative to the root the right foot goes back 3 cm a frame and the left one up by 1.
    let feet: Vec<[DVec3; 2]> = (0..4)
        .map(f64::from)
        .map(|t| [DVec3::new(0.0, -90.0, -3.0 * t), DVec3::new(0.0, t, 0.0)])
        .collect();
    let weights = [[1.0, 0.0], [0.0, 1.0], [0.5, 0.5], [7.0, 7.0]];
    let start = DVec3::new(5.0, 90.0, 1.0);
    let steps = [
        DVec3::ZERO,
        DVec3::new(0.0, 0.0, 3.0),
        DVec3::new(0.0, -1.0, 3.0),
        DVec3::new(0.0, -1.5, 4.5),
    ];
    let expected = steps.map(|step| start + step);
    assert_eq!(reconstruct_root(&feet, &weights, start), expected);
    assert_eq!(reconstruct_root(&feet[..1], &weights[..1], start), [start]);
    assert_eq!(reconstruct_root(&[], &[], start), []);
}

fn place() -> impl Strategy<Value = DVec3> {
    prop::array::uniform3(-100.0..100.0f64).prop_map(DVec3::from)
}

proptest! {
    #[test]
    fn the_foot_in_contact_stands_still(
        frames in prop::collection::vec(([place(), place()], 0usize..2), 1..30),
        start in place(),
    ) {
        let feet: Vec<[DVec3; 2]> = frames.iter().map(|(feet, _)| *feet).collect();
        let label = |foot: usize| std::array::from_fn(|it| f64::from(u8::from(it == foot)));
        let labels: Vec<[f64; 2]> = frames.iter().map(|(_, foot)| label(*foot)).collect();
        let roots = reconstruct_root(&feet, &labels, start);
        prop_assert_eq!(roots.len(), frames.len());
        prop_assert_eq!(roots[0], start);
        for t in 1..frames.len() {
            let foot = frames[t - 1].1;
            let step = (roots[t] + feet[t][foot]).distance(roots[t - 1] + feet[t - 1][foot]);
            prop_assert!(step < 1e-9, "frame {t}: {step}");
        }
    }
}

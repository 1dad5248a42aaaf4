//! Windows of clips.

use std::f64::consts::PI;

use keydance::models::transition::window::{window_features, wrap};
use keydance::models::transition::windows;
use keydance::motion::features::FACING;
use ndarray::Array2;
use proptest::prelude::*;

#[test]
fn angles_at_the_edges_are_wrapped_into_the_half_open_range() {
    for angle in [PI, -PI, 3.0 * PI, -1e-17 - PI, PI - 1e-17, 1e9, -1e9] {
        let wrapped = wrap(angle);
        assert!((-PI..PI).contains(&wrapped), "{angle} became {wrapped}");
    }
}

proptest! {
    #[test]
    fn a_window_keeps_its_turning_and_starts_in_range(angles in prop::collection::vec(-100.0..100.0f64, 8), start in 0usize..4) {
        let mut clip = Array2::zeros((8, 154));
        clip.column_mut(FACING.start).assign(&ndarray::Array1::from(angles.clone()));
        let window = window_features(&clip, start, 4);
        prop_assert!((-PI..PI).contains(&window[[0, FACING.start]]));
        for time in 1..=4 {
            let turned = window[[time, FACING.start]] - window[[0, FACING.start]];
            prop_assert!((turned - (angles[start + time] - angles[start])).abs() < 1e-9);
        }
    }
}

#[test]
fn the_stride_is_the_tenth_of_the_window_rounded_up() {
    for (transition, stride) in [
        (5, 1),
        (9, 1),
        (10, 2),
        (50, 6),
        (99, 10),
        (100, 11),
        (150, 16),
    ] {
        assert_eq!(
            windows(&[1000], transition).windows[1].start,
            stride,
            "N = {transition}"
        );
    }
}

#[test]
fn the_last_window_fits_and_no_further_one_would() {
    let found = windows(&[23, 11, 10], 10);
    let starts = |clip| {
        found
            .windows
            .iter()
            .filter(|w| w.clip == clip)
            .map(|w| w.start)
            .collect::<Vec<_>>()
    };
    assert_eq!(starts(0), [0, 2, 4, 6, 8, 10, 12]);
    assert_eq!(starts(1), [0]);
    assert_eq!(found.skipped, [2]);
}

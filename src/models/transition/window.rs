//! One window's features.

use std::f64::consts::{PI, TAU};

use ndarray::{Array2, s};

use crate::motion::features::FACING;

/// Features of the window that starts at frame `start`, `[transition + 1, 154]`, not standardised.
///
/// The facing angle is shifted by a multiple of 2 pi so that the first frame's lies in [-pi, pi).
/// The window must lie in the clip.
pub fn window_features(clip: &Array2<f64>, start: usize, transition: usize) -> Array2<f64> {
    let mut window = clip.slice(s![start..=start + transition, ..]).to_owned();
    let mut facing = window.column_mut(FACING.start);
    let first = facing[0];
    let shift = wrap(first) - first;
    facing.iter_mut().for_each(|angle| *angle += shift);
    facing[0] = wrap(first);
    window
}

/// The angle in [-pi, pi) that differs by a multiple of 2 pi.
pub fn wrap(angle: f64) -> f64 {
    let wrapped = (angle + PI).rem_euclid(TAU) - PI;
    // Just below a full turn the remainder rounds up to the turn itself.
    if wrapped < PI { wrapped } else { -PI }
}

#[cfg(test)]
mod tests {
    use super::*;
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
}

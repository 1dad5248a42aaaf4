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

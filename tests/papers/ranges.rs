//! Which controls the training clips hold.

use keydance::models::transition::{DataRanges, Standardisation};
use keydance::motion::features::FEATURES;
use keydance::motion::features::{ROOT_POSITION, ROOT_VELOCITY, VELOCITY_FACTORS};
use ndarray::Array2;

/// 2000 frames with the root at 80 + frame / 100 cm, moving at 5 cm/frame, in one of them at
/// 900.
fn clip() -> Array2<f64> {
    let mut clip = Array2::zeros((2000, FEATURES));
    for (frame, mut row) in clip.rows_mut().into_iter().enumerate() {
        row[ROOT_POSITION.start + 1] = 80.0 + frame as f64 / 100.0;
        row[ROOT_VELOCITY.start] = 3.0;
        row[ROOT_VELOCITY.start + 2] = 4.0;
        row[VELOCITY_FACTORS.start] = (frame % 10) as f64;
    }
    clip[[500, ROOT_VELOCITY.start]] = 900.0;
    clip
}

#[test]
fn a_single_outlier_does_not_widen_the_bounds() {
    let clip = clip();
    let ranges = DataRanges::of([clip.view()]).unwrap();
    assert_eq!(ranges.root_speed, 5.0);
    assert_eq!(ranges.velocity_factors[0], 9.0);
    let [low, high] = ranges.root_height;
    assert!(
        (low - 80.02).abs() < 0.011 && (high - 99.97).abs() < 0.011,
        "{low} {high}"
    );
    assert_eq!(DataRanges::of([]), None);
}

#[test]
fn statistics_give_bounds_that_hold_the_data() {
    let clip = clip();
    let ranges = DataRanges::of([clip.view()]).unwrap();
    let wide = DataRanges::from_statistics(&Standardisation::fit([clip.view()]));
    assert!(wide.root_speed > ranges.root_speed);
    assert!(wide.root_height[0] < ranges.root_height[0]);
    assert!(wide.root_height[1] > ranges.root_height[1]);
    assert!(wide.velocity_factors[0] > ranges.velocity_factors[0]);
}

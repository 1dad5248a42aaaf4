//! Frames of reference of a window's root.

use keydance::models::transition::{RootFrame, Standardisation, window_features, windows};
use keydance::motion::features::{FACING, FEATURES};
use ndarray::Array2;

/// A root that walks 3 cm a frame along x and stands at a height and a z of its own.
fn walk(frames: usize) -> Array2<f64> {
    Array2::from_shape_fn((frames, FEATURES), |(t, column)| match column {
        69 => 500.0 + 3.0 * t as f64,
        70 => 90.0 + (t % 2) as f64,
        71 => -200.0,
        _ => (t * (column + 1)) as f64 % 7.0,
    })
}

#[test]
fn a_window_from_its_keyframe_begins_at_the_origin_at_its_own_height() {
    let clip = walk(30);
    let window = RootFrame::Keyframe.window_features(&clip, 11, 5);
    assert_eq!(window.column(69).to_vec(), [0.0, 3.0, 6.0, 9.0, 12.0, 15.0]);
    assert_eq!(window.column(70)[0], 91.0);
    assert!(window.column(71).iter().all(|&z| z == 0.0));
    let world = RootFrame::World.window_features(&clip, 11, 5);
    assert_eq!(world, window_features(&clip, 11, 5));
    for column in (0..FEATURES).filter(|column| ![69, 71].contains(column)) {
        assert_eq!(window.column(column), world.column(column));
    }
}

#[test]
fn a_window_in_its_keyframes_facing_begins_at_0_and_is_left_where_it_was() {
    let clip = walk(30);
    let window = RootFrame::KeyframeFacing.window_features(&clip, 11, 5);
    assert_eq!(window[[0, FACING.start]], 0.0);
    let world = window_features(&clip, 11, 5);
    let frame = RootFrame::KeyframeFacing.of_window(world.row(0));
    let (sin, cos) = world[[0, FACING.start]].sin_cos();
    for (row, mut seen) in window
        .rows()
        .into_iter()
        .map(|row| row.to_owned())
        .enumerate()
    {
        // It walks along x; seen from a dancer that faces (sin, cos) on the floor (x, z).
        let walked = 3.0 * row as f64;
        assert!((seen[69] - walked * cos).abs() < 1e-9);
        assert!((seen[71] - walked * sin).abs() < 1e-9);
        assert_eq!(seen[70], world[[row, 70]]);
        frame.leave(seen.view_mut());
        for (column, (left, there)) in seen.iter().zip(world.row(row)).enumerate() {
            assert!((left - there).abs() < 1e-9, "column {column}");
        }
    }
}

#[test]
fn statistics_in_the_keyframes_facing_are_those_of_what_windows_show() {
    let clips = [walk(40), walk(25)];
    let fitted = RootFrame::KeyframeFacing
        .standardisation(clips.iter().map(|clip| clip.view()).collect::<Vec<_>>(), 10);
    let cut = windows(&[40, 25], 10).windows;
    let seen: Vec<_> = cut
        .iter()
        .map(|cut| RootFrame::KeyframeFacing.window_features(&clips[cut.clip], cut.start, 10))
        .collect();
    for column in [69, 71, FACING.start, 146, 148] {
        let values: Vec<f64> = seen
            .iter()
            .flat_map(|window| window.column(column).to_vec().split_off(1))
            .map(|value| (value - fitted.mean[column]) / fitted.std[column])
            .collect();
        let count = values.len() as f64;
        assert!((values.iter().sum::<f64>() / count).abs() < 1e-9);
        assert!((values.iter().map(|x| x * x).sum::<f64>() / count - 1.0).abs() < 1e-9);
    }
}

#[test]
fn statistics_from_the_keyframe_are_those_of_the_steps_in_the_windows() {
    let clips = [walk(40), walk(25)];
    let views = || clips.iter().map(|clip| clip.view());
    let fitted = RootFrame::Keyframe.standardisation(views().collect::<Vec<_>>(), 10);
    // Steps of 3 .. 30 cm in every window: mean 16.5, variance 9 (10^2 - 1) / 12.
    assert!((fitted.mean[69] - 16.5).abs() < 1e-9);
    assert!((fitted.std[69] - (9.0 * 99.0 / 12.0f64).sqrt()).abs() < 1e-9);
    assert_eq!((fitted.mean[71], fitted.std[71]), (0.0, 1.0));
    let world = Standardisation::fit(views().collect::<Vec<_>>());
    for column in (0..FEATURES).filter(|column| ![69, 71].contains(column)) {
        assert_eq!(fitted.mean[column], world.mean[column]);
        assert_eq!(fitted.std[column], world.std[column]);
    }
    let same = RootFrame::World.standardisation(views().collect::<Vec<_>>(), 10);
    assert_eq!(same, world);
}

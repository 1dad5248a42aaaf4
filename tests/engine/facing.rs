//! Facing angles over time.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use keydance::motion::facing::{FacingJoints, gaussian, unwrap};

use crate::dance_clip::turning_clip;

#[test]
fn smoothing_agrees_with_scipy() {
    // scipy.ndimage.gaussian_filter1d([0, 0, 1, 5, -2], 1.5, mode="nearest"), likewise [3, -1,
    // 0, 0, 7]
    let expected_x = [0.27188328, 0.67025507, 1.02270121, 0.80875307, -0.09178544];
    let expected_z = [1.7469826, 1.14805353, 1.3275359, 2.59391143, 4.42102501];
    let values =
        [[0.0, 3.0], [0.0, -1.0], [1.0, 0.0], [5.0, 0.0], [-2.0, 7.0]].map(DVec2::from_array);
    let smoothed = gaussian(&values, [values[0], values[4]], 1.5);
    for (time, smooth) in smoothed.into_iter().enumerate() {
        assert!(
            smooth.distance(DVec2::new(expected_x[time], expected_z[time])) < 1e-7,
            "{time}: {smooth}"
        );
    }
}

#[test]
fn unwrapped_angles_take_the_short_way() {
    let mut angles = vec![3.0, -3.0, 0.0, 3.0, -3.0, -0.5];
    unwrap(&mut angles);
    let expected = [
        3.0,
        TAU - 3.0,
        TAU,
        TAU + 3.0,
        2.0 * TAU - 3.0,
        2.0 * TAU - 0.5,
    ];
    assert!(
        angles
            .iter()
            .zip(expected)
            .all(|(found, expected)| (found - expected).abs() < 1e-12),
        "{angles:?}"
    );
}

#[test]
fn a_body_by_itself_faces_where_it_was_turned_to_on_any_skeleton_with_the_joints() {
    for angle in [-3.0, -0.5, 0.0, 1.0, 3.1] {
        let clip = turning_clip("a", 1, |_| (DVec3::new(7.0, 90.0, -3.0), angle));
        let joints = FacingJoints::of(&clip.skeleton).unwrap();
        assert_eq!(joints, FacingJoints::DANCE);
        let positions = clip.poses[0].world_positions(&clip.skeleton);
        assert!((joints.angle(&positions) - angle).abs() < 1e-12, "{angle}");
    }
    let mut skeleton = turning_clip("a", 1, |_| (DVec3::Y, 0.0)).skeleton;
    skeleton.joints.swap(1, 5);
    let swapped = FacingJoints::of(&skeleton).unwrap();
    assert_eq!(swapped.hips, [5, 1]);
    skeleton.joints[15].name = "RightUpperArm".into();
    let text = FacingJoints::of(&skeleton).unwrap_err().to_string();
    assert!(text.contains("none called RightArm"), "{text}");
}

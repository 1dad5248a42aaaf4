//! Motion in columns: what they mean, back to the same motion, mirror images.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::motion::{
    Clip, ColumnsError, GroundPlace, MotionColumns, NamedRotation, mirror_image, resample,
};
use ndarray::{Array2, s};

use crate::dance_clip::turning_clip;

fn dances() -> Vec<Clip> {
    let config = ChoreographyConfig {
        clips: 3,
        frames_per_clip: 150,
        seed: 4,
    };
    let dances = generate(&config).unwrap().into_iter();
    dances
        .map(|dance| resample(dance.clip, 20.0).unwrap())
        .collect()
}

fn columns_of(clip: &Clip) -> MotionColumns {
    MotionColumns::of_all(&clip.name, &clip.skeleton).unwrap()
}

fn rebuilt(
    columns: &MotionColumns,
    numbers: &Array2<f64>,
    clip: &Clip,
    start: GroundPlace,
) -> Clip {
    let bones = clip.skeleton.rest_pose();
    let poses = columns.poses(numbers.view(), &clip.skeleton, &bones, start);
    Clip {
        poses: poses.unwrap(),
        ..clip.clone()
    }
}

fn difference(a: &Array2<f64>, b: &Array2<f64>) -> f64 {
    assert_eq!(a.dim(), b.dim());
    (a - b).iter().fold(0.0, |most, x| most.max(x.abs()))
}

#[test]
fn a_turning_walk_has_its_speeds_in_the_heading_of_each_frame() {
    // 3 cm a frame the way that is looked at, 0.1 rad to the left a frame.
    let mut place = DVec3::new(5.0, 90.0, -2.0);
    let mut places = vec![(place, 0.4)];
    for frame in 1..30 {
        let heading = 0.4 + 0.1 * f64::from(frame);
        place += DQuat::from_rotation_y(heading) * DVec3::new(0.0, 0.0, 3.0);
        places.push((place, heading));
    }
    let clip = turning_clip("walk", 30, |frame| places[frame]);
    let columns = columns_of(&clip);
    let numbers = columns.measure(&clip).unwrap();
    assert_eq!(numbers.dim(), (30, 7 + 3 * 23));
    let names = columns.names();
    assert_eq!((&*names[0].0, names[0].1), ("root_dx", "cm/frame"));
    assert_eq!((&*names[6].0, names[6].1), ("root_dheading", "rad/frame"));
    assert_eq!((&*names[9].0, names[9].1), ("LeftUpLeg_z", "rad"));
    for row in numbers.rows() {
        let expected = [0.0, 3.0, 90.0, 0.0, 0.0, 0.0, 0.1];
        for (number, expected) in row.iter().zip(expected) {
            assert!((number - expected).abs() < 1e-12, "{row}");
        }
    }
}

#[test]
fn headings_that_pass_half_a_turn_change_by_little() {
    let clip = turning_clip("spin", 60, |frame| (DVec3::Y, 0.3 * frame as f64));
    let numbers = columns_of(&clip).measure(&clip).unwrap();
    let turns = numbers.column(6);
    assert!(
        turns.iter().all(|turn| (turn - 0.3).abs() < 1e-12),
        "{turns}"
    );
}

#[test]
fn columns_become_a_motion_with_the_same_columns() {
    for clip in dances() {
        let columns = columns_of(&clip);
        let numbers = columns.measure(&clip).unwrap();
        let start = GroundPlace {
            x: -40.0,
            z: 7.0,
            heading: 2.0,
        };
        for start in [GroundPlace::default(), start] {
            let again = rebuilt(&columns, &numbers, &clip, start);
            let back = columns.measure(&again).unwrap();
            assert!(difference(&numbers, &back) < 1e-9);
            let begins = GroundPlace::of(&again.poses[0]);
            assert!((begins.x - start.x).abs() < 1e-9 && (begins.z - start.z).abs() < 1e-9);
            assert!((begins.heading - start.heading).abs() < 1e-9);
        }
    }
}

#[test]
fn a_motion_is_rebuilt_where_it_was_and_goes_on_from_any_of_its_frames() {
    for clip in dances() {
        let columns = columns_of(&clip);
        let numbers = columns.measure(&clip).unwrap();
        let world = clip.skeleton.world_positions(&clip.poses);
        let start = GroundPlace::of(&clip.poses[0]);
        let whole = rebuilt(&columns, &numbers, &clip, start).poses;
        let before = &clip.poses[39];
        let rest = columns.poses_after(
            numbers.slice(s![40.., ..]),
            &clip.skeleton,
            before,
            GroundPlace::of(before),
        );
        for (poses, from) in [(whole, 0), (rest.unwrap(), 40)] {
            assert_eq!(poses.len(), clip.poses.len() - from);
            for (pose, expected) in poses.iter().zip(&world[from..]) {
                let positions = pose.world_positions(&clip.skeleton);
                for (joint, expected) in positions.iter().zip(expected) {
                    assert!(joint.distance(*expected) < 1e-9);
                }
            }
        }
    }
}

#[test]
fn the_mirror_image_of_columns_is_that_of_the_motion_and_twice_it_is_the_motion() {
    for clip in dances() {
        let columns = columns_of(&clip);
        let numbers = columns.measure(&clip).unwrap();
        let image = columns.mirrored(numbers.view()).unwrap();
        let expected = columns.measure(&mirror_image(&clip)).unwrap();
        assert!(difference(&image, &expected) < 1e-9);
        assert!(difference(&image, &numbers) > 0.1);
        assert_eq!(columns.mirrored(image.view()).unwrap(), numbers);
    }
}

#[test]
fn joints_that_are_left_out_are_put_back_and_others_are_measured_from_a_rotation_of_theirs() {
    let mut clip = dances().remove(0);
    let spine = clip.skeleton.index_of("Spine2").unwrap();
    let bent = DQuat::from_rotation_x(0.3);
    clip.poses
        .iter_mut()
        .for_each(|pose| pose.rotations[spine] = bent);
    let named = |joint: &str, rotation| NamedRotation {
        joint: joint.into(),
        rotation,
    };
    let all = columns_of(&clip);
    let from = |joint: &NamedRotation| match &*joint.joint {
        "LeftArm" => named("LeftArm", DQuat::from_rotation_z(1.0)),
        _ => joint.clone(),
    };
    let turning = all.turning().iter().filter(|joint| joint.joint != "Spine2");
    let fixed = vec![named("Spine2", bent)];
    let columns = MotionColumns::new("some", turning.map(from).collect(), fixed).unwrap();
    let numbers = columns.measure(&clip).unwrap();
    assert_eq!(numbers.ncols(), all.width() - 3);
    let again = rebuilt(&columns, &numbers, &clip, GroundPlace::of(&clip.poses[0]));
    for (a, b) in again.poses.iter().zip(&clip.poses) {
        for (a, b) in a.rotations.iter().zip(&b.rotations) {
            assert!(a.dot(*b).abs() > 1.0 - 1e-12);
        }
    }
    let names = columns.names();
    let arm = names
        .iter()
        .position(|(name, _)| name == "LeftArm_x")
        .unwrap();
    let difference = (&numbers.column(arm) - &all.measure(&clip).unwrap().column(arm + 3))
        .abs()
        .sum();
    assert!(difference > 1.0, "{difference}");
}

#[test]
fn rotations_that_pass_half_a_turn_are_counted() {
    let mut clip = turning_clip("flip", 20, |_| (DVec3::Y, 0.0));
    let arm = clip.skeleton.index_of("RightArm").unwrap();
    let columns = columns_of(&clip);
    assert_eq!(columns.flips(columns.measure(&clip).unwrap().view()), 0);
    for (frame, pose) in clip.poses.iter_mut().enumerate() {
        // From 2.95 to 3.33 rad, and back.
        pose.rotations[arm] = DQuat::from_rotation_z(PI + 0.19 * (1.7 * frame as f64).cos());
    }
    let signs = (0..20).map(|frame| (1.7 * f64::from(frame)).cos() > 0.0);
    let signs: Vec<bool> = signs.collect();
    let changes = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let flips = columns.flips(columns.measure(&clip).unwrap().view());
    assert_eq!((flips, flips > 5), (changes, true));
}

#[test]
fn what_does_not_fit_is_named() {
    let clip = turning_clip("some.bvh", 3, |_| (DVec3::Y, 0.0));
    let columns = columns_of(&clip);
    let mut other = clip.clone();
    other.skeleton.joints[20].name = "Elbow".into();
    let error = columns.measure(&other).unwrap_err().to_string();
    assert!(
        error.contains("some.bvh has no joint LeftForeArm"),
        "{error}"
    );
    let narrow = Array2::zeros((3, 5));
    let bones = clip.skeleton.rest_pose();
    let error = columns.poses(
        narrow.view(),
        &clip.skeleton,
        &bones,
        GroundPlace::default(),
    );
    assert!(matches!(error, Err(ColumnsError::Width { found: 5, .. })));
    assert!(columns.mirrored(narrow.view()).is_err());
    assert!(MotionColumns::new("nothing", Vec::new(), Vec::new()).is_err());
    let empty = columns
        .measure(&Clip {
            poses: Vec::new(),
            ..clip
        })
        .unwrap();
    assert_eq!(empty.dim(), (0, 76));
}

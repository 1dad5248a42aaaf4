//! The 154 numbers of a frame on motions whose features are known.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use assert_cmd::cargo::cargo_bin_cmd;
use glam::{DQuat, DVec3, EulerRot};
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use keydance::motion::facing::{FacingJoints, facing_angles, facing_angles_between};
use keydance::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FEATURES, ROOT_POSITION, ROOT_VELOCITY,
    VELOCITY_FACTORS,
};
use keydance::motion::{
    DANCE_JOINTS, FeatureConfig, FeatureError, at_tempo, features, mirror_image,
};
use ndarray::{Array2, s};
use proptest::prelude::*;

use crate::dance_clip::turning_clip;

const HIPS: DVec3 = DVec3::new(0.0, 90.0, 0.0);

fn measured(frames: usize, root: impl Fn(usize) -> (DVec3, f64)) -> Array2<f64> {
    features(
        &turning_clip("drawn", frames, root),
        &FeatureConfig::default(),
    )
    .unwrap()
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

#[test]
fn the_ranges_follow_each_other_and_fill_the_frame() {
    let ranges = [
        BODY_POSITIONS,
        ROOT_POSITION,
        FACING,
        CONTACTS,
        BODY_VELOCITIES,
        ROOT_VELOCITY,
        VELOCITY_FACTORS,
    ];
    assert_eq!(
        ranges.clone().map(|range| range.len()),
        [69, 3, 1, 4, 69, 3, 5]
    );
    assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
    assert_eq!(VELOCITY_FACTORS.end, FEATURES);
}

#[test]
fn the_pose_does_not_depend_on_where_the_dancer_stands_and_looks() {
    let reference = measured(3, |_| (HIPS, 0.0));
    assert!(close(reference[[0, FACING.start]], 0.0));
    // The left hand stretches along +X, the toes point along +Z.
    assert!(close(reference[[0, 3 * 20]], 70.0) && close(reference[[0, 3 * 3 + 2]], 13.0));
    for angle in [-3.0, -FRAC_PI_2, 0.3, FRAC_PI_2, 3.0] {
        let turned = measured(3, |_| (DVec3::new(100.0, 95.0, -30.0), angle));
        assert!(close(turned[[1, FACING.start]], angle), "{angle}");
        let apart =
            &turned.slice(s![.., BODY_POSITIONS]) - &reference.slice(s![.., BODY_POSITIONS]);
        assert!(
            apart.iter().all(|&difference| close(difference, 0.0)),
            "{angle}"
        );
        assert_eq!(
            turned.slice(s![1, ROOT_POSITION]).to_vec(),
            [100.0, 95.0, -30.0]
        );
    }
}

#[test]
fn the_facing_angle_counts_turns() {
    let speed = 0.05;
    let facing = measured(500, |frame| (HIPS, speed * frame as f64 - 1.0))
        .column(FACING.start)
        .to_vec();
    assert!(
        facing
            .windows(2)
            .all(|pair| (0.0..2.0 * speed).contains(&(pair[1] - pair[0])))
    );
    // The held ends bend the smoothed angle; in the middle it is the angle itself.
    assert!((100..400).all(|frame| (facing[frame] - (speed * frame as f64 - 1.0)).abs() < 1e-3));
    assert!(facing[499] - facing[0] > 3.0 * TAU);
    assert!((-PI..=PI).contains(&facing[0]));
}

#[test]
fn velocities_are_differences_and_the_first_frame_has_none() {
    let numbers = measured(10, |frame| {
        (HIPS + DVec3::new(2.0, 0.0, 0.5) * frame as f64, 0.0)
    });
    assert!(
        numbers
            .slice(s![0, BODY_VELOCITIES.start..])
            .iter()
            .all(|&number| number == 0.0)
    );
    for time in 1..10 {
        let velocity = numbers.slice(s![time, ROOT_VELOCITY]).to_vec();
        assert!(close(velocity[0], 2.0) && close(velocity[1], 0.0) && close(velocity[2], 0.5));
        assert!(
            numbers
                .slice(s![time, BODY_VELOCITIES])
                .iter()
                .all(|&number| close(number, 0.0))
        );
        // Only the root moves: the trunk's factor has its weight, 1 of 9.
        let speed = 4.25f64.sqrt();
        assert!(close(numbers[[time, VELOCITY_FACTORS.start]], speed / 9.0));
    }
}

#[test]
fn contacts_follow_the_world_and_the_threshold() {
    let labels = |speed: f64, contact_threshold: f64| {
        let clip = turning_clip("drawn", 5, |frame| {
            (HIPS + DVec3::X * speed * frame as f64, 0.0)
        });
        let config = FeatureConfig {
            contact_threshold,
            ..FeatureConfig::default()
        };
        features(&clip, &config)
            .unwrap()
            .slice(s![.., CONTACTS])
            .iter()
            .copied()
            .collect::<Vec<_>>()
    };
    assert_eq!(labels(0.4, 0.2), [1.0; 20]);
    assert_eq!(labels(0.5, 0.2), [0.0; 20]);
    assert_eq!(labels(0.5, 0.3), [1.0; 20]);
}

#[test]
fn a_clip_at_twice_the_tempo_has_every_second_pose_and_at_half_the_poses_between_too() {
    let clip = turning_clip("drawn", 41, |t| {
        let t = t as f64;
        (DVec3::new(9.0 * t, 90.0 + t, 40.0 - t * t), 0.03 * t - 1.0)
    });
    let fast = at_tempo(clip.clone(), 2.0).unwrap();
    let slow = at_tempo(clip.clone(), 0.5).unwrap();
    assert_eq!([fast.frame_time, slow.frame_time], [clip.frame_time; 2]);
    assert_eq!([fast.poses.len(), slow.poses.len()], [21, 81]);
    for (frame, pose) in clip.poses.iter().enumerate() {
        assert_eq!(&slow.poses[2 * frame], pose);
        if frame % 2 == 0 {
            assert_eq!(&fast.poses[frame / 2], pose);
        }
    }
    assert!(at_tempo(clip, 0.0).is_err());
}

#[test]
fn the_features_of_a_mirror_image_are_the_clips_with_sides_changed_and_x_turned_round() {
    let clip = turning_clip("drawn", 12, |t| {
        let t = t as f64;
        (DVec3::new(9.0 * t, 90.0 + t, 40.0 - t * t), 0.3 * t - 1.0)
    });
    let mut clip = clip;
    for (t, pose) in clip.poses.iter_mut().enumerate() {
        for (joint, rotation) in pose.rotations.iter_mut().enumerate().skip(1) {
            let angle = 0.05 * ((t * (joint + 2)) % 9) as f64;
            *rotation *= DQuat::from_euler(EulerRot::XYZ, angle, -0.7 * angle, 0.4);
        }
    }
    let image = mirror_image(&clip);
    assert_eq!(mirror_image(&image), clip);
    assert!(image.skeleton.is_dance_skeleton());
    let measure = |clip| features(clip, &FeatureConfig::default()).unwrap();
    let (seen, image) = (measure(&clip), measure(&image));
    let joint = |name: &str| {
        DANCE_JOINTS
            .iter()
            .position(|&joint| joint == name)
            .unwrap()
            - 1
    };
    let mut compared = 0;
    for name in &DANCE_JOINTS[1..] {
        let partner = match (name.strip_prefix("Left"), name.strip_prefix("Right")) {
            (Some(part), _) => format!("Right{part}"),
            (_, Some(part)) => format!("Left{part}"),
            _ => name.to_string(),
        };
        for (axis, sign) in [-1.0, 1.0, 1.0].into_iter().enumerate() {
            for numbers in [BODY_POSITIONS, BODY_VELOCITIES] {
                let [at, partner] =
                    [joint(name), joint(&partner)].map(|j| numbers.start + 3 * j + axis);
                for t in 0..12 {
                    assert!(
                        close(image[[t, at]], sign * seen[[t, partner]]),
                        "{name} {t}"
                    );
                    compared += 1;
                }
            }
        }
    }
    assert_eq!(compared, 12 * 138);
    for t in 0..12 {
        for at in [ROOT_POSITION.start, ROOT_VELOCITY.start] {
            assert!(close(image[[t, at]], -seen[[t, at]]));
            assert!(close(image[[t, at + 1]], seen[[t, at + 1]]));
            assert!(close(image[[t, at + 2]], seen[[t, at + 2]]));
        }
        assert!(close(image[[t, FACING.start]], -seen[[t, FACING.start]]));
        for (at, partner) in [(0, 2), (1, 3), (2, 0), (3, 1)] {
            assert_eq!(
                image[[t, CONTACTS.start + at]],
                seen[[t, CONTACTS.start + partner]]
            );
        }
        // Trunk, left leg, right leg, right arm, left arm.
        for (at, partner) in [(0, 0), (1, 2), (2, 1), (3, 4), (4, 3)] {
            let at = VELOCITY_FACTORS.start + at;
            assert!(close(
                image[[t, at]],
                seen[[t, VELOCITY_FACTORS.start + partner]]
            ));
        }
    }
}

#[test]
fn what_cannot_be_measured_is_an_error() {
    let clip = turning_clip("drawn", 5, |_| (HIPS, 0.0));
    let mut other = clip.clone();
    other.skeleton.joints[9].name = "Chest".into();
    let expected = FeatureError::NotTheDanceSkeleton {
        clip: "drawn".into(),
        index: 9,
        expected: "Spine on Hips".into(),
        found: "Chest on Hips".into(),
    };
    assert_eq!(features(&other, &FeatureConfig::default()), Err(expected));
    let empty = turning_clip("drawn", 0, |_| (HIPS, 0.0));
    assert_eq!(
        features(&empty, &FeatureConfig::default()),
        Err(FeatureError::NoFrames {
            clip: "drawn".into()
        })
    );
    for facing_sigma in [0.0, -1.0, f64::NAN, 1e12] {
        let config = FeatureConfig {
            facing_sigma,
            ..FeatureConfig::default()
        };
        assert!(
            features(&clip, &config)
                .unwrap_err()
                .to_string()
                .starts_with("facing_sigma = "),
            "{facing_sigma}"
        );
    }
}

#[test]
fn the_binary_writes_the_same_numbers_as_float32() {
    let folder = tempfile::tempdir().unwrap();
    let (input, output) = (
        folder.path().join("clip.bvh"),
        folder.path().join("clip.npy"),
    );
    let clip = turning_clip("clip.bvh", 40, |frame| (HIPS, 0.02 * frame as f64));
    bvh::write(
        &input,
        &Bvh::from_clip(&clip, channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y])).unwrap(),
    )
    .unwrap();
    cargo_bin_cmd!("keydance")
        .arg("features")
        .arg(&input)
        .arg("--npy")
        .arg(&output)
        .assert()
        .success();
    let written: Array2<f32> = ndarray_npy::read_npy(&output).unwrap();
    let expected = features(&clip, &FeatureConfig::default()).unwrap();
    assert_eq!(written.dim(), (40, 154));
    assert!(
        written
            .iter()
            .zip(&expected)
            .all(|(&found, &expected)| (f64::from(found) - expected).abs() < 1e-4)
    );
}

/// World positions of the figure turning by the given angles.
fn turning(angles: &[f64]) -> Vec<Vec<DVec3>> {
    let clip = turning_clip("turning", angles.len(), |t| (HIPS, angles[t]));
    clip.skeleton.world_positions(&clip.poses)
}

proptest! {
    #[test]
    fn facing_between_keyframes_begins_and_ends_with_theirs(
        angles in prop::collection::vec(-9.0..9.0f64, 1..40),
        known in prop::array::uniform2(-9.0..9.0f64),
    ) {
        let between = facing_angles_between(&turning(&angles), &FacingJoints::DANCE, known, 20.0);
        prop_assert_eq!(between.len(), angles.len());
        prop_assert!((between[0] - known[0]).abs() < 1e-9 || angles.len() == 1);
        let turns = (between[angles.len() - 1] - known[1]) / TAU;
        prop_assert!((turns - turns.round()).abs() < 1e-9 || angles.len() == 1);
    }
}

#[test]
fn facing_between_keyframes_of_a_recorded_clip_is_that_of_the_whole_clip() {
    // Turns to and fro with a full turn in the middle, as dancers do.
    let angle = |t: usize| {
        let t = t as f64;
        0.8 * (t / 23.0).sin() + 0.3 * (t / 7.0).sin() + TAU / (1.0 + (-(t - 200.0) / 12.0).exp())
    };
    let angles: Vec<f64> = (0..400).map(angle).collect();
    let world = turning(&angles);
    let whole = facing_angles(&world, &FacingJoints::DANCE, 20.0);
    let (mut between, mut alone, mut count) = (0.0, 0.0, 0);
    for length in [5, 30, 100] {
        for start in (0..400 - length).step_by(20) {
            let window = &world[start..=start + length];
            let known = [whole[start], whole[start + length]];
            let pairs = [
                facing_angles_between(window, &FacingJoints::DANCE, known, 20.0),
                facing_angles(window, &FacingJoints::DANCE, 20.0),
            ]
            .map(|found| {
                let errors = found.iter().zip(&whole[start..]).map(|(a, b)| {
                    let turns = (a - b) / TAU;
                    (turns - turns.round()).abs() * TAU
                });
                errors.sum::<f64>() / (length + 1) as f64
            });
            between += pairs[0];
            alone += pairs[1];
            count += 1;
        }
    }
    let (between, alone) = (between / f64::from(count), alone / f64::from(count));
    assert!(
        between < 0.04 && between < 0.25 * alone,
        "{between} {alone} rad"
    );
}

//! Positions to rotations and back.

use glam::{DQuat, DVec3};
use keydance::data::{DataConfig, Dataset, Split};
use keydance::motion::fit::{RotationFitError, fit_rotations};
use keydance::motion::placement::world_positions;
use keydance::motion::{
    Clip, DANCE_JOINTS, DANCE_PARENTS, FeatureConfig, JOINTS, Joint, Pose, Skeleton, features,
};
use proptest::prelude::*;

use crate::real_data::dance_folder;

fn skeleton() -> Skeleton {
    let joints = DANCE_JOINTS
        .iter()
        .zip(DANCE_PARENTS)
        .enumerate()
        .map(|(index, (name, parent))| Joint {
            name: name.to_string(),
            parent,
            offset: match *name {
                "LeftUpLeg" | "LeftShoulder" => DVec3::new(9.0, 2.0, -2.0),
                "RightUpLeg" | "RightShoulder" => DVec3::new(-9.0, 2.0, -2.0),
                _ => DVec3::new(0.0, if index < 9 { -30.0 } else { 11.0 }, 0.0),
            },
            end_sites: Vec::new(),
        })
        .collect();
    Skeleton { joints }
}

/// A dancer on the test skeleton that turns and bends every joint at its own speed.
fn clip(frames: usize, speed: f64) -> Clip {
    let skeleton = skeleton();
    let pose = |time: usize| {
        let mut translations: Vec<DVec3> =
            skeleton.joints.iter().map(|joint| joint.offset).collect();
        translations[0] = DVec3::new(time as f64, 90.0, 2.0 * time as f64);
        let turn = |joint: usize| {
            let axis = DVec3::new(1.0, joint as f64 % 3.0, 0.5).normalize();
            DQuat::from_axis_angle(axis, speed * (1.0 + joint as f64 / 24.0) * time as f64)
        };
        Pose {
            translations,
            rotations: (0..JOINTS).map(turn).collect(),
        }
    };
    Clip {
        name: "bends".into(),
        poses: (0..frames).map(pose).collect(),
        skeleton,
        frame_time: 1.0 / 30.0,
    }
}

fn world(clip: &Clip) -> Vec<Vec<DVec3>> {
    clip.skeleton.world_positions(&clip.poses)
}

proptest! {
    #[test]
    fn positions_of_a_pose_are_met_again(speed in 0.0..0.2f64) {
        let clip = clip(12, speed);
        let fit = fit_rotations(&clip.skeleton, &world(&clip), &clip.poses[0], None).unwrap();
        prop_assert!(fit.max_error < 1e-6, "{}", fit.max_error);
        prop_assert!(fit.mean_error <= fit.max_error);
    }

    #[test]
    fn bones_keep_their_length_whatever_the_positions(noise in prop::collection::vec(prop::array::uniform3(-20.0..20.0f64), JOINTS)) {
        let clip = clip(2, 0.1);
        let mut wanted = world(&clip);
        for (joint, noise) in wanted[1].iter_mut().zip(&noise) {
            *joint += DVec3::from(*noise);
        }
        let fit = fit_rotations(&clip.skeleton, &wanted, &clip.poses[0], None).unwrap();
        let found = fit.poses[1].world_positions(&clip.skeleton);
        prop_assert!(found[0].distance(wanted[1][0]) < 1e-9);
        for (index, joint) in clip.skeleton.joints.iter().enumerate() {
            if let Some(parent) = joint.parent {
                prop_assert!((found[index].distance(found[parent]) - joint.offset.length()).abs() < 1e-6);
            }
        }
        let worst = found.iter().zip(&wanted[1]).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max);
        prop_assert!((fit.max_error - worst).abs() < 1e-9);
    }

    #[test]
    fn world_positions_undo_the_features(speed in 0.0..0.3f64) {
        let clip = clip(5, speed);
        let features = features(&clip, &FeatureConfig::default()).unwrap();
        for (frame, expected) in features.rows().into_iter().zip(world(&clip)) {
            for (found, expected) in world_positions(frame).iter().zip(expected) {
                prop_assert!(found.distance(expected) < 1e-9);
            }
        }
    }
}

#[test]
fn a_pose_that_already_fits_keeps_its_rotations() {
    let clip = clip(8, 0.3);
    let fit = fit_rotations(&clip.skeleton, &world(&clip)[7..], &clip.poses[7], None).unwrap();
    for (found, expected) in fit.poses[0].rotations.iter().zip(&clip.poses[7].rotations) {
        assert!(found.angle_between(*expected) < 1e-6);
    }
}

#[test]
fn bones_that_are_too_long_are_reported_in_the_error() {
    let clip = clip(1, 0.0);
    let mut wanted = world(&clip);
    // The head 5 cm farther along its bone: 5 cm off at one of 24 joints.
    wanted[0][23].y += 5.0;
    let fit = fit_rotations(&clip.skeleton, &wanted, &clip.poses[0], None).unwrap();
    assert!((fit.max_error - 5.0).abs() < 1e-9);
    assert!((fit.mean_error - 5.0 / 24.0).abs() < 1e-9);
}

#[test]
fn positions_that_do_not_fit_the_skeleton_are_errors() {
    let clip = clip(3, 0.1);
    let mut wanted = world(&clip);
    wanted[2][5].z = f64::NAN;
    let error = fit_rotations(&clip.skeleton, &wanted, &clip.poses[0], None).unwrap_err();
    assert!(
        error.to_string().contains("frame 2, joint RightUpLeg"),
        "{error}"
    );
    wanted[1].pop();
    let error = fit_rotations(&clip.skeleton, &wanted, &clip.poses[0], None).unwrap_err();
    assert!(
        error.to_string().contains("frame 1 has 23 joints"),
        "{error}"
    );
    let none: [Vec<DVec3>; 0] = [];
    let error = fit_rotations(&clip.skeleton, &none, &clip.poses[0], None).unwrap_err();
    assert_eq!(error, RotationFitError::NoFrames);
}

fn recorded_clip() -> Option<Clip> {
    let folder = dance_folder()?;
    let config = DataConfig {
        split: Split::List {
            train: vec!["Andria_Angry_v1-BVH.bvh".into()],
            validation: Vec::new(),
            test: vec!["Anna_Active-BVH.bvh".into()],
        },
        ..DataConfig::default()
    };
    let data = Dataset::load(&folder, &config).unwrap();
    Some(data.train[0].clip.clone())
}

#[test]
fn recorded_dance_is_met_within_a_millimetre() {
    let Some(clip) = recorded_clip() else {
        return;
    };
    let fit = fit_rotations(&clip.skeleton, &world(&clip), &clip.poses[0], None).unwrap();
    println!("mean {:.4} cm, max {:.4} cm", fit.mean_error, fit.max_error);
    assert!(fit.max_error < 0.1, "{} cm", fit.max_error);
}

/// Angles (degrees) between the local rotations of every joint in two runs of poses.
fn angles(a: &[Pose], b: &[Pose]) -> Vec<f64> {
    let pairs = a.iter().zip(b).flat_map(|(a, b)| {
        let pairs = a.rotations.iter().zip(&b.rotations);
        pairs.map(|(a, b)| a.angle_between(*b).to_degrees())
    });
    pairs.collect()
}

fn quantile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[(share * (values.len() - 1) as f64) as usize]
}

#[test]
fn fitted_rotations_of_recorded_dance_change_no_faster_than_the_recorded_ones() {
    let Some(clip) = recorded_clip() else {
        return;
    };
    const N: usize = 100;
    let (poses, world) = (&clip.poses, world(&clip));
    let (mut recorded, mut fitted, mut off) = (Vec::new(), Vec::new(), [Vec::new(), Vec::new()]);
    for start in (0..poses.len() - N).step_by(N) {
        let frames = start + 1..start + N + 1;
        let wanted = &world[frames.clone()];
        for (off, end) in off.iter_mut().zip([None, Some(&poses[start + N])]) {
            let fit = fit_rotations(&clip.skeleton, wanted, &poses[start], end).unwrap();
            assert!(fit.max_error < 0.1, "{} cm", fit.max_error);
            off.extend(angles(&fit.poses, &poses[frames.clone()]));
            if end.is_some() {
                fitted.extend(angles(&fit.poses[1..], &fit.poses));
            }
        }
        recorded.extend(angles(&poses[start + 2..=start + N], &poses[start + 1..]));
    }
    for share in [0.5, 0.99, 0.999, 1.0] {
        let (found, own) = (quantile(&mut fitted, share), quantile(&mut recorded, share));
        println!("{share}: fitted {found:.2} degrees a frame, recorded {own:.2}");
        assert!(found <= own, "{share}: {found} {own}");
    }
    let [alone, between] = off.map(|angles| angles.iter().sum::<f64>() / angles.len() as f64);
    println!(
        "from the recorded rotations {alone:.2} degrees in the mean, {between:.2} with the last pose known"
    );
    assert!(between < alone, "{between} {alone}");
}

#[test]
fn a_hand_turns_evenly_from_one_keyframe_to_the_next() {
    let still = clip(11, 0.0);
    let mut end = still.poses[10].clone();
    end.rotations[17] = DQuat::from_rotation_x(1.0);
    let fit = fit_rotations(
        &still.skeleton,
        &world(&still)[1..],
        &still.poses[0],
        Some(&end),
    );
    for (frame, pose) in fit.unwrap().poses.iter().enumerate() {
        let expected = DQuat::from_rotation_x((frame + 1) as f64 / 10.0);
        assert!(
            pose.rotations[17].angle_between(expected) < 1e-6,
            "frame {frame}"
        );
    }
}

#[test]
fn a_twist_that_positions_do_not_show_follows_the_way_between_the_keyframes() {
    let still = clip(41, 0.0);
    let mut end = still.poses[40].clone();
    // The forearm about its own bone, which leads along Y.
    end.rotations[16] = DQuat::from_rotation_y(1.0);
    let wanted = &world(&still)[1..];
    let fit = fit_rotations(&still.skeleton, wanted, &still.poses[0], Some(&end)).unwrap();
    let mut before = 0.0;
    for (frame, pose) in fit.poses.iter().enumerate() {
        let rotation = pose.rotations[16];
        let twist = 2.0 * rotation.y.atan2(rotation.w);
        assert!(
            twist > before,
            "frame {frame}: {twist} rad after {before} rad"
        );
        assert!(rotation.angle_between(DQuat::from_rotation_y(twist)) < 1e-6);
        before = twist;
    }
    // It lags by some eight frames of 1/40 rad each.
    assert!((0.6..=1.0).contains(&before), "{before} rad");
}

#[test]
fn a_bent_elbow_shows_how_the_upper_arm_is_turned() {
    let mut bent = clip(41, 0.0);
    for (time, pose) in bent.poses.iter_mut().enumerate() {
        // The upper arm turns about itself, which only the forearm shows.
        pose.rotations[15] = DQuat::from_rotation_y(0.05 * time as f64);
        pose.rotations[16] = DQuat::from_rotation_x(1.5);
    }
    let fit = fit_rotations(&bent.skeleton, &world(&bent)[1..], &bent.poses[0], None).unwrap();
    let (found, expected) = (&fit.poses[39].rotations, &bent.poses[40].rotations);
    assert!(found[15].angle_between(expected[15]) < 0.1);
}

#[test]
fn the_spine_shares_what_the_shoulders_are_turned() {
    let mut turned = clip(2, 0.0);
    for joint in 9..14 {
        turned.poses[1].rotations[joint] = DQuat::from_rotation_y(0.1);
    }
    let fit = fit_rotations(
        &turned.skeleton,
        &world(&turned)[1..],
        &turned.poses[0],
        None,
    )
    .unwrap();
    let expected = DQuat::from_rotation_y(0.1);
    for (name, rotation) in DANCE_JOINTS
        .iter()
        .zip(&fit.poses[0].rotations)
        .skip(9)
        .take(5)
    {
        let off = rotation.angle_between(expected);
        assert!(off < 1e-6, "{name}: {off}");
    }
}

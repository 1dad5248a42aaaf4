//! Clips in other units and with other axes: what is recognised, and what is made of it.

use glam::{DQuat, DVec3};
use keydance::data::{DataConfig, DataError, FileReading};
use keydance::motion::{Clip, DANCE_JOINTS, Mapping, Measured, Unit, Up};

use crate::dance_clip::turning_clip;

/// A figure that walks, turns and bends every joint a little.
fn dancer() -> Clip {
    let mut clip = turning_clip("dancer.bvh", 20, |frame| {
        let time = frame as f64;
        (DVec3::new(2.0 * time, 90.0, 0.5 * time), 0.05 * time)
    });
    for (frame, pose) in clip.poses.iter_mut().enumerate() {
        for (joint, rotation) in pose.rotations.iter_mut().enumerate().skip(1) {
            *rotation = DQuat::from_rotation_x(0.0005 * (joint * frame) as f64)
                * DQuat::from_rotation_z(0.002 * joint as f64);
        }
    }
    clip
}

/// The clip with every vector and every rotation changed.
fn changed(
    mut clip: Clip,
    vector: impl Fn(DVec3) -> DVec3,
    rotation: impl Fn(DQuat) -> DQuat,
) -> Clip {
    for joint in &mut clip.skeleton.joints {
        joint.offset = vector(joint.offset);
        joint
            .end_sites
            .iter_mut()
            .for_each(|end| *end = vector(*end));
    }
    for pose in &mut clip.poses {
        pose.translations
            .iter_mut()
            .for_each(|place| *place = vector(*place));
        pose.rotations
            .iter_mut()
            .for_each(|turn| *turn = rotation(*turn));
    }
    clip
}

fn scaled(clip: Clip, factor: f64) -> Clip {
    changed(clip, |vector| vector * factor, |rotation| rotation)
}

/// With Z up instead of Y, everything turned.
fn z_up(clip: Clip) -> Clip {
    let turn = |v: DVec3| DVec3::new(v.x, -v.z, v.y);
    changed(clip, turn, |q| {
        let axis = turn(DVec3::new(q.x, q.y, q.z));
        DQuat::from_xyzw(axis.x, axis.y, axis.z, q.w)
    })
}

/// The same motion, the world turned by its root alone.
fn turned_root(mut clip: Clip, turn: DQuat) -> Clip {
    for pose in &mut clip.poses {
        pose.translations[0] = turn * pose.translations[0];
        pose.rotations[0] = turn * pose.rotations[0];
    }
    clip
}

fn config(unit: Unit, up: Up) -> DataConfig {
    DataConfig {
        unit,
        up,
        ..DataConfig::default()
    }
}

fn read(clip: Clip, config: &DataConfig) -> (Clip, Vec<String>) {
    let FileReading {
        recording, notices, ..
    } = FileReading::of(clip, None, config).unwrap();
    (recording.clip, notices)
}

/// Asserts that two clips have the same offsets, translations and rotations.
fn assert_same(found: &Clip, expected: &Clip) {
    for (found, expected) in found.skeleton.joints.iter().zip(&expected.skeleton.joints) {
        assert!(
            found.offset.distance(expected.offset) < 1e-9,
            "{}",
            found.name
        );
    }
    for (found, expected) in found.poses.iter().zip(&expected.poses) {
        for joint in 0..24 {
            assert!(found.translations[joint].distance(expected.translations[joint]) < 1e-9);
            assert!(found.rotations[joint].dot(expected.rotations[joint]).abs() > 1.0 - 1e-12);
        }
    }
}

#[test]
fn centimetres_with_y_up_are_read_to_the_bit_and_without_a_word() {
    let clip = dancer();
    for declared in [config(Unit::Auto, Up::Auto), config(Unit::Cm, Up::Y)] {
        assert_eq!(read(clip.clone(), &declared), (clip.clone(), Vec::new()));
    }
}

#[test]
fn metres_inches_millimetres_and_z_up_become_the_same_clip_whole_and_are_named() {
    let clip = dancer();
    for (unit, per_cm) in [("m", 0.01), ("in", 1.0 / 2.54), ("mm", 10.0)] {
        for turned in [false, true] {
            let odd = scaled(clip.clone(), per_cm);
            let odd = if turned { z_up(odd) } else { odd };
            let (found, notices) = read(odd.clone(), &DataConfig::default());
            assert_same(&found, &clip);
            let said = notices.join("\n");
            assert!(
                said.contains(&format!("taken as {unit} and converted")),
                "{said}"
            );
            assert_eq!(said.contains("stands along Z: turned"), turned, "{said}");

            let up = if turned { Up::Z } else { Up::Y };
            let (declared, notices) = read(odd, &config(unit.parse().unwrap(), up));
            assert_same(&declared, &clip);
            assert_eq!(notices, Vec::<String>::new());
        }
    }
}

#[test]
fn what_is_declared_is_believed() {
    let metres = scaled(dancer(), 0.01);
    assert_eq!(
        read(metres.clone(), &config(Unit::Cm, Up::Y)),
        (metres, Vec::new())
    );
    let inches = read(scaled(dancer(), 1.0), &config(Unit::In, Up::Auto)).0;
    assert_same(&inches, &scaled(dancer(), 2.54));
}

#[test]
fn a_body_of_no_known_size_is_taken_as_centimetres_with_a_word() {
    let clip = scaled(dancer(), 0.18);
    let (found, notices) = read(clip.clone(), &DataConfig::default());
    assert_eq!(found, clip);
    assert!(
        notices[0].contains("31 units tall, which is a grown-up in none of"),
        "{notices:?}"
    );
}

#[test]
fn lying_and_crouching_dancers_are_not_turned() {
    let quarter = std::f64::consts::FRAC_PI_2;
    for turn in [
        DQuat::from_rotation_x(quarter),
        DQuat::from_rotation_x(-quarter),
        DQuat::from_rotation_z(quarter),
        DQuat::from_rotation_x(0.8),
        DQuat::from_rotation_x(-2.0),
    ] {
        let mut lying = dancer();
        for pose in &mut lying.poses {
            pose.translations[0].y = 12.0;
            pose.rotations[0] = turn * pose.rotations[0];
        }
        assert_eq!(
            read(lying.clone(), &DataConfig::default()),
            (lying.clone(), Vec::new())
        );
        // The same with Z up lies with Y up, too.
        let (found, notices) = read(z_up(lying.clone()), &DataConfig::default());
        assert_same(&found, &lying);
        assert_eq!(notices.len(), 1);
    }
}

/// The same frames with all bones along X at rest, as some recorders write them.
fn along_x(clip: Clip) -> Clip {
    let mut other = clip.clone();
    for (joint, own) in other.skeleton.joints.iter_mut().zip(&clip.skeleton.joints) {
        if own.parent.is_some() {
            joint.offset = DVec3::X * own.offset.length();
        }
    }
    for (pose, own) in other.poses.iter_mut().zip(&clip.poses) {
        let (world, _) = own.world(&clip.skeleton);
        pose.rotations = vec![DQuat::IDENTITY; 24];
        for joint in 1..24 {
            let parent = clip.skeleton.joints[joint].parent.unwrap();
            pose.translations[joint] = world[joint] - world[parent];
        }
    }
    other
}

/// Everything elsewhere.
fn moved(mut clip: Clip, by: DVec3) -> Clip {
    for pose in &mut clip.poses {
        pose.translations[0] += by;
    }
    clip
}

/// A dancer who goes this far in a frame.
fn walking(mut clip: Clip, by: DVec3) -> Clip {
    for (frame, pose) in clip.poses.iter_mut().enumerate() {
        pose.translations[0] += frame as f64 * by;
    }
    clip
}

fn up(clip: &Clip) -> Option<Up> {
    Measured::of(clip).up
}

#[test]
fn a_rest_pose_that_does_not_stand_leaves_the_axis_to_the_frames() {
    assert_eq!(up(&along_x(dancer())), Some(Up::Y));
    let standing = along_x(z_up(dancer()));
    assert_eq!(up(&standing), Some(Up::Z));
    let (found, _) = read(standing, &DataConfig::default());
    let world = |clip: &Clip| clip.poses[7].world_positions(&clip.skeleton);
    for (found, expected) in world(&found).iter().zip(world(&dancer())) {
        assert!(found.distance(expected) < 1e-9);
    }
    // Who lies along Z has the feet beside the plane z = 0.
    let mut lying = dancer();
    for pose in &mut lying.poses {
        pose.translations[0] = DVec3::new(0.0, 12.0, 0.0);
        pose.rotations[0] = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    }
    assert_eq!(up(&along_x(lying.clone())), None);
    let (_, notices) = read(along_x(lying), &DataConfig::default());
    assert!(
        notices[0].contains("lies along Z in most frames"),
        "{notices:?}"
    );
}

#[test]
fn the_axis_is_recognised_wherever_the_floor_is() {
    for height in [-93.0, -40.0, 40.0, 100.0, 500.0] {
        for aside in [0.0, 60.0, -200.0] {
            let there = moved(dancer(), DVec3::new(3.0, height, aside));
            for clip in [there.clone(), along_x(there.clone())] {
                assert_eq!(up(&clip), Some(Up::Y), "{height} {aside}");
            }
            let turned = z_up(there);
            for clip in [turned.clone(), along_x(turned)] {
                assert_eq!(up(&clip), Some(Up::Z), "{height} {aside}");
            }
        }
    }
}

#[test]
fn a_body_that_stands_along_y_is_not_laid_down_by_its_rest_pose() {
    let quarter = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    for height in [-93.0, 0.0, 50.0, 100.0] {
        let clip = moved(dancer(), DVec3::new(0.0, height, 80.0));
        // The rest pose stands along Z, and the root turns it up.
        let odd = turned_root(z_up(clip.clone()), quarter);
        let (found, notices) = read(odd.clone(), &DataConfig::default());
        assert_eq!((found, notices), (odd, Vec::new()), "{height}");
    }
}

#[test]
fn who_goes_about_says_which_way_is_up_lying_and_by_the_root_alone() {
    let quarter = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    for height in [-60.0, 0.0, 70.0] {
        let there = walking(
            moved(dancer(), DVec3::Y * height),
            DVec3::new(1.0, 0.0, 4.0),
        );
        // Only the root is turned, and the rest pose stands along Y.
        let by_root = turned_root(there.clone(), quarter);
        assert_same(&read(by_root, &DataConfig::default()).0, &there);
        let mut crawling = there;
        for pose in &mut crawling.poses {
            pose.rotations[0] *= DQuat::from_rotation_x(0.9);
        }
        let crawling = along_x(crawling);
        assert_eq!(up(&crawling), Some(Up::Y), "{height}");
        assert_eq!(up(&z_up(crawling)), Some(Up::Z), "{height}");
    }
}

#[test]
fn an_axis_that_cannot_be_up_is_said() {
    let half = std::f64::consts::FRAC_PI_2;
    for (turn, says) in [
        (DQuat::from_rotation_z(-half), "along X in most"),
        (DQuat::from_rotation_z(half), "along -X in most"),
        (DQuat::from_rotation_x(2.0 * half), "along -Y in most"),
        (DQuat::from_rotation_x(-half), "along -Z in most"),
    ] {
        let clip = changed(dancer(), |v| turn * v, |q| turn * q * turn.inverse());
        let (found, notices) = read(clip.clone(), &DataConfig::default());
        assert_eq!(found, clip);
        let said = notices.join("\n");
        assert!(
            said.contains(says) && said.contains("taken with Y up"),
            "{said}"
        );
    }
}

#[test]
fn a_body_without_any_length_is_not_measured() {
    let flat = scaled(dancer(), 0.0);
    assert_eq!(Measured::of(&flat), Measured::default());
}

#[test]
fn a_declared_z_axis_of_the_root_alone_leaves_the_rest_pose_standing() {
    let clip = dancer();
    let turn = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let odd = turned_root(clip.clone(), turn);
    let (found, _) = read(odd, &config(Unit::Auto, Up::Z));
    assert_same(&found, &clip);
}

#[test]
fn a_body_collapsed_into_a_point_is_measured_by_its_offsets_and_said_to_be_so() {
    let mut clip = dancer();
    for pose in &mut clip.poses {
        pose.translations[1..].fill(DVec3::ZERO);
    }
    let (found, notices) = read(clip.clone(), &DataConfig::default());
    assert_eq!(found, clip);
    assert_eq!(notices.len(), 1, "{notices:?}");
    assert!(notices[0].contains("23 joints (LeftUpLeg, LeftLeg, LeftFoot, ...) are 0 in every"));
}

#[test]
fn a_mapping_declares_unit_and_axis_or_leaves_them_to_be_recognised() {
    let clip = dancer();
    let joints: String = DANCE_JOINTS
        .map(|name| format!("{name} = \"{name}\"\n"))
        .concat();
    let mapping = |keys: &str| Mapping::parse(&format!("{keys}\n[joints]\n{joints}"), "map.toml");
    let odd = z_up(scaled(clip.clone(), 0.01));
    let auto = DataConfig::default();
    let read = |keys: &str, config: &DataConfig| {
        FileReading::of(odd.clone(), Some(&mapping(keys).unwrap()), config)
    };
    for (keys, notices) in [
        ("", 2),
        ("unit = \"m\"", 1),
        ("up = \"z\"", 1),
        ("unit = \"m\"\nup = \"z\"", 0),
        ("scale = 100.0\nup = \"z\"", 0),
        ("unit = \"auto\"\nup = \"auto\"", 2),
    ] {
        let found = read(keys, &auto).unwrap();
        assert_same(&found.recording.clip, &clip);
        assert_eq!(found.notices.len(), notices, "{keys}: {:?}", found.notices);
    }
    let as_it_is = read("scale = 1.0\nup = \"y\"", &auto).unwrap();
    assert_same(&as_it_is.recording.clip, &odd);
    let both = mapping("scale = 100.0\nunit = \"m\"")
        .unwrap_err()
        .to_string();
    assert!(
        both.contains("map.toml gives both scale and unit"),
        "{both}"
    );
    let twice = read("scale = 100.0", &config(Unit::M, Up::Auto))
        .unwrap_err()
        .to_string();
    assert!(
        twice.contains("data.unit = m and the mapping file map.toml"),
        "{twice}"
    );
    let twice = read("up = \"y\"", &config(Unit::Auto, Up::Z))
        .unwrap_err()
        .to_string();
    assert!(
        twice.contains("data.up = z and the mapping file map.toml"),
        "{twice}"
    );
    assert!(mapping("unit = \"ell\"").is_err() && mapping("up = \"x\"").is_err());
}

#[test]
fn rounded_frame_times_are_taken_for_the_rate_that_they_mean() {
    let frames = |frame_time: f64, config: &DataConfig| {
        let clip = Clip {
            frame_time,
            ..dancer()
        };
        let (clip, notices) = read(clip, config);
        (1.0 / clip.frame_time, clip.poses.len(), notices.len())
    };
    // At the rate of the file, so that nothing is resampled.
    for (frame_time, fps, notices) in [
        (0.033, 30.0, 1),
        (0.0333, 30.0, 1),
        (0.0333333, 30.0, 0),
        (0.0334, 30_000.0 / 1001.0, 1),
        (0.0083, 120.0, 1),
        (0.00833, 120.0, 1),
        (0.008, 120.0, 1),
        (0.0167, 60.0, 1),
        (0.0166, 60.0, 1),
        (0.017, 60.0, 1),
        (0.016, 60.0, 1),
        (0.0417, 24.0, 1),
        (0.042, 24.0, 1),
        (0.041, 24.0, 1),
        (0.04171, 24_000.0 / 1001.0, 0),
        (0.03333, 30.0, 1),
        (0.033333, 30.0, 0),
        (0.01111, 90.0, 1),
        (0.067, 15.0, 1),
        (0.083, 12.0, 1),
        (0.021, 48.0, 1),
        (0.0208, 48.0, 1),
        (0.0133, 75.0, 1),
        (0.0069, 144.0, 1),
        (0.0067, 150.0, 1),
        (0.0033, 300.0, 1),
        (0.0028, 360.0, 1),
        (0.0139, 72.0, 1),
        (0.0111, 90.0, 1),
        (0.004, 240.0, 1),
        (0.0042, 240.0, 1),
        (0.04, 25.0, 0),
        (0.02, 50.0, 0),
        (0.05, 20.0, 0),
        (0.01, 100.0, 0),
        (0.005, 200.0, 0),
        (0.025, 40.0, 0),
    ] {
        let at_that_rate = DataConfig {
            fps,
            ..DataConfig::default()
        };
        let (found, frames, said) = frames(frame_time, &at_that_rate);
        assert!((found / fps - 1.0).abs() < 1e-4, "{frame_time}: {found}");
        assert_eq!((frames, said), (20, notices), "{frame_time}");
    }
    // No rate that anybody records at: brought to 30 with a word.
    for odd in [0.03, 0.054, 0.07] {
        let (_, _, said) = frames(odd, &DataConfig::default());
        assert_eq!(said, 1, "{odd}");
    }
    let declared = DataConfig {
        source_fps: Some(60.0),
        ..DataConfig::default()
    };
    assert_eq!(frames(0.033, &declared), (30.0, 10, 0));
    for fps in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let config = DataConfig {
            source_fps: Some(fps),
            ..DataConfig::default()
        };
        let error = FileReading::of(dancer(), None, &config).unwrap_err();
        assert!(matches!(
            error,
            DataError::Config {
                key: "source_fps",
                ..
            }
        ));
    }
}

#[test]
fn a_jump_out_of_the_first_frames_is_named_and_they_can_be_left_out() {
    for held in [1, 3] {
        let mut clip = dancer();
        let mut t_pose = clip.poses[0].clone();
        t_pose.rotations[1..].fill(DQuat::IDENTITY);
        t_pose.rotations[0] = DQuat::from_rotation_y(1.5);
        for _ in 0..held {
            clip.poses.insert(0, t_pose.clone());
        }
        let (_, notices) = read(clip.clone(), &DataConfig::default());
        let key = format!("data.skip_frames = {held} in a config");
        assert!(
            notices.len() == 1 && notices[0].contains(&key),
            "{notices:?}"
        );
        let config = DataConfig {
            skip_frames: held,
            ..DataConfig::default()
        };
        assert_eq!(read(clip, &config), (dancer(), Vec::new()));
    }
    // A filter smears the jump over some frames, and a T-pose may be held for long.
    for (held, smeared) in [(1, 3), (40, 0), (40, 3)] {
        let mut clip = dancer();
        let dance = clip.poses.clone();
        for _ in 0..9 {
            clip.poses.extend(dance.iter().rev().cloned());
            clip.poses.extend(dance.iter().cloned());
        }
        let dance = clip.poses[0].clone();
        let mut t_pose = dance.clone();
        t_pose.rotations[1..].fill(DQuat::IDENTITY);
        t_pose.rotations[0] = DQuat::from_rotation_y(1.5);
        let between = (1..=smeared).rev().map(|step| {
            let share = 1.0 - (f64::from(step) / f64::from(smeared + 1)).powi(2);
            dance.towards(&t_pose, share)
        });
        let beginning: Vec<_> = std::iter::repeat_n(t_pose.clone(), held).collect();
        let between: Vec<_> = between.collect();
        let first = [beginning, between.into_iter().rev().collect()].concat();
        clip.poses.splice(0..0, first);
        let (_, notices) = read(clip, &DataConfig::default());
        let key = format!("data.skip_frames = {} in a config", held + smeared as usize);
        assert!(
            notices.len() == 1 && notices[0].contains(&key),
            "{key} {notices:?}"
        );
    }
    let config = DataConfig {
        skip_frames: 20,
        ..DataConfig::default()
    };
    let error = FileReading::of(dancer(), None, &config)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("20, but dancer.bvh has 20 frames"),
        "{error}"
    );
}

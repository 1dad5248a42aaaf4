//! Mapping files: other skeletons on the 24 joints.

use std::path::Path;

use glam::{DQuat, DVec3};
use keydance::data::{DataConfig, Dataset, Split};
use keydance::models::transition::DanceClip;
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use keydance::motion::{DANCE_JOINTS, Mapping, resample};

use crate::dance_clip::turning_clip;
use crate::lafan1_data::lafan1_folder;
use crate::martial_data;

/// A mapping of the dance skeleton on itself, with some lines in place of others.
fn mapping(scale: &str, changed: &[(&str, &str)]) -> String {
    let lines =
        DANCE_JOINTS.iter().map(
            |name| match changed.iter().find(|(joint, _)| joint == name) {
                Some((_, source)) => format!("{name} = {source}\n"),
                None => format!("{name} = \"{name}\"\n"),
            },
        );
    format!("{scale}\n[joints]\n{}", lines.collect::<String>())
}

fn bent_clip() -> keydance::motion::Clip {
    let mut clip = turning_clip("bent", 6, |frame| {
        (DVec3::new(1.0, 90.0, frame as f64), 0.1 * frame as f64)
    });
    for (frame, pose) in clip.poses.iter_mut().enumerate() {
        for (joint, rotation) in pose.rotations.iter_mut().enumerate() {
            *rotation *= DQuat::from_rotation_x(0.01 * (joint * frame) as f64)
                * DQuat::from_rotation_z(0.02 * joint as f64);
        }
    }
    clip
}

#[test]
fn mapped_joints_have_the_world_transforms_of_their_sources() {
    let mut clip = bent_clip();
    clip.skeleton.joints[23].end_sites = vec![DVec3::X, DVec3::new(0.0, 5.0, 2.0)];
    let changed = [
        ("Head", "\"Head/End Site 2\""),
        ("Spine2", "{ between = [\"Spine1\", \"Neck\"], at = 0.25 }"),
        ("LeftArm", "\"RightArm\""),
        ("RightArm", "\"LeftArm\""),
    ];
    let mapped = Mapping::parse(&mapping("scale = 2.0", &changed), "map.toml")
        .unwrap()
        .apply(&clip)
        .unwrap();
    assert!(mapped.skeleton.is_dance_skeleton());
    for (old, new) in clip.poses.iter().zip(&mapped.poses) {
        let (positions, rotations) = old.world(&clip.skeleton);
        let (found, turned) = new.world(&mapped.skeleton);
        for joint in 0..24 {
            let (position, rotation) = match DANCE_JOINTS[joint] {
                "Head" => (
                    positions[23] + rotations[23] * DVec3::new(0.0, 5.0, 2.0),
                    rotations[23],
                ),
                "Spine2" => (
                    positions[10].lerp(positions[22], 0.25),
                    rotations[10].slerp(rotations[22], 0.25),
                ),
                "LeftArm" => (positions[15], rotations[15]),
                "RightArm" => (positions[19], rotations[19]),
                _ => (positions[joint], rotations[joint]),
            };
            assert!(
                found[joint].distance(2.0 * position) < 1e-9,
                "{}",
                DANCE_JOINTS[joint]
            );
            assert!(
                (turned[joint] * DVec3::ONE).distance(rotation * DVec3::ONE) < 1e-9,
                "{}",
                DANCE_JOINTS[joint]
            );
        }
    }
}

#[test]
fn a_mapped_clip_can_be_written_and_read_back() {
    let changed = [("Spine2", "{ between = [\"Spine1\", \"Neck\"], at = 0.25 }")];
    let mapped = Mapping::parse(&mapping("", &changed), "map.toml")
        .unwrap()
        .apply(&bent_clip())
        .unwrap();
    let document = Bvh::from_clip(
        &mapped,
        channel_layout(&mapped, [Axis::Z, Axis::X, Axis::Y]),
    )
    .unwrap();
    let again = bvh::parse(document.to_text().as_bytes(), "again.bvh")
        .unwrap()
        .to_clip();
    for (old, new) in mapped.poses.iter().zip(&again.poses) {
        let pairs = old
            .world_positions(&mapped.skeleton)
            .into_iter()
            .zip(new.world_positions(&again.skeleton));
        assert!(pairs.into_iter().all(|(old, new)| old.distance(new) < 1e-5));
    }
}

#[test]
fn a_bad_mapping_is_named() {
    let message = |text: &str| match Mapping::parse(text, "map.toml") {
        Err(error) => format!("{:#}", anyhow::Error::from(error)),
        Ok(mapping) => mapping.apply(&bent_clip()).unwrap_err().to_string(),
    };
    let cases = [
        (
            mapping("", &[("Head", "\"Skull\"")]),
            "Head is mapped to \"Skull\", which bent does not have (Hips, LeftUpLeg",
        ),
        (
            mapping("", &[("Head", "\"Head/End Site 2\"")]),
            "\"Head/End Site 2\"",
        ),
        (
            mapping("", &[("Head", "\"Hips/End Site\"")]),
            "\"Hips/End Site\"",
        ),
        (
            mapping("", &[]) + "Tail = \"Hips\"",
            "[joints] names Tail, which is not a joint of the dance skeleton",
        ),
        (
            mapping("", &[])
                .replace("Neck = \"Neck\"\n", "")
                .replace("Hips = \"Hips\"\n", ""),
            "[joints] lacks Hips, Neck",
        ),
        (
            mapping("scale = -1.0", &[]),
            "scale = -1: expected a positive number",
        ),
        (mapping("size = 1.0", &[]), "unknown field `size`"),
        (
            mapping(
                "",
                &[("Head", "{ between = [\"Neck\", \"Hips\"], at = 1.5 }")],
            ),
            "Head.at = 1.5",
        ),
        (
            mapping("", &[("Head", "{ between = [\"Neck\"], at = 0.5 }")]),
            "expected a joint's name in quotes, or",
        ),
        (
            mapping("", &[("Head", "3")]),
            "expected a joint's name in quotes, or",
        ),
        ("joints".into(), "map.toml is not a mapping file"),
    ];
    for (text, part) in cases {
        let found = message(&text);
        assert!(
            found.contains(part) && found.contains("map.toml"),
            "{found}"
        );
    }
}

#[test]
fn a_config_holds_all_that_a_mapping_file_says() {
    let between = "{ between = [\"Hips\", \"Spine2\"], at = 0.25 }";
    let changed = [("Spine1", "\"Neck\""), ("Spine", between)];
    for head in [
        "unit = \"in\"\nup = \"z\"",
        "scale = 3",
        "up = \"y\"",
        "unit = \"auto\"",
    ] {
        let read = Mapping::parse(&mapping(head, &changed), "map.toml").unwrap();
        let config = DataConfig {
            mapping: Some(read.clone()),
            ..DataConfig::default()
        };
        let text = toml::to_string(&config).unwrap();
        let held: DataConfig = toml::from_str(&text).unwrap();
        assert_eq!(toml::to_string(&held).unwrap(), text);
        let held = held.mapping.unwrap();
        assert_eq!(
            held.apply(&bent_clip()).unwrap(),
            read.apply(&bent_clip()).unwrap()
        );
        assert_eq!(
            (held.has_unit(), held.has_up()),
            (read.has_unit(), read.has_up())
        );
    }
    let text = toml::to_string(&Mapping::parse(&mapping("", &[]), "map.toml").unwrap()).unwrap();
    let lacking = toml::from_str::<Mapping>(&text.replace("Head =", "Tail ="));
    let message = lacking.unwrap_err().to_string();
    assert!(
        message.contains("the mapping of the config: [joints] names Tail"),
        "{message}"
    );
}

#[test]
fn martial_arts_clips_go_through_the_pipeline() {
    let Some(folder) = martial_data::martial_folder() else {
        return;
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/mappings/cmu.toml");
    let mapping = Mapping::read(&path).unwrap();
    let config = DataConfig {
        split: Split::Share(0.8),
        mapping: Some(mapping.clone()),
        ..DataConfig::default()
    };
    let dataset = Dataset::load(&folder, &config).unwrap();
    assert_eq!((dataset.train.len(), dataset.test.len()), (6, 2));
    for clip in dataset.train.iter().chain(&dataset.test) {
        let document = bvh::read(&folder.join(clip.name())).unwrap();
        assert_eq!(clip.frames(), document.frames().div_ceil(4));
        let measured = DanceClip::measure(clip.clip.clone(), &config.features()).unwrap();
        assert!(measured.features.iter().all(|number| number.is_finite()));
        let source = document.to_clip();
        let mapped = mapping
            .apply(&resample(source.clone(), 30.0).unwrap())
            .unwrap();
        let foot = source.skeleton.index_of("lFoot").unwrap();
        for (frame, pose) in mapped.poses.iter().enumerate() {
            let (positions, rotations) = source.poses[4 * frame].world(&source.skeleton);
            let found = pose.world_positions(&mapped.skeleton);
            let toe = positions[foot] + rotations[foot] * source.skeleton.joints[foot].end_sites[0];
            assert!(found[3].distance(positions[foot]) < 1e-9 && found[4].distance(toe) < 1e-9);
        }
    }
}

#[test]
fn the_way_back_from_the_24_joints_is_where_lafan1s_joints_are() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/mappings/lafan1.toml");
    let mapping = Mapping::read(&path).unwrap();
    let Some(folder) = lafan1_folder() else {
        return;
    };
    let document = bvh::read(&folder.join("walk1_subject1.bvh")).unwrap();
    let mut clip = document.to_clip();
    clip.poses.truncate(20);
    let counterparts = mapping.counterparts(&clip.skeleton).unwrap();
    assert_eq!(counterparts.len(), 22);
    let mapped = mapping.apply(&clip).unwrap();
    for (own, pose) in clip.poses.iter().zip(&mapped.poses) {
        let (own, seen) = (
            own.world_positions(&clip.skeleton),
            pose.world_positions(&mapped.skeleton),
        );
        for (position, &at) in own.iter().zip(&counterparts) {
            assert!(position.distance(seen[at]) < 1e-9);
        }
    }
}

#[test]
fn a_joint_that_nothing_stands_for_has_no_way_back() {
    let clip = bent_clip();
    let changed = [("Head", "\"Neck\"")];
    let mapping = Mapping::parse(&mapping("", &changed), "map.toml").unwrap();
    let error = mapping
        .counterparts(&clip.skeleton)
        .unwrap_err()
        .to_string();
    assert!(
        error.contains("map.toml: no joint of the dance skeleton stands for Head"),
        "{error}"
    );
}

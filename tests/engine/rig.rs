//! Rigs of other programs: recognised by names and places, and given their motion back.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DQuat, DVec3};
use keydance::data::choreography::{ChoreographyConfig, generate};
use keydance::motion::rest_pose::{RestPose, rest_directions};
use keydance::motion::rig::{Rig, RigKeyframe, nearest_frames, onto_rig, spread};
use keydance::motion::{
    Clip, Conversion, DANCE_JOINTS, Mapping, Pose, Recognised, Skeleton, Unit, Up,
};

use crate::rigs::{RIGS, from_another_rest_pose};

/// A body that walks along and turns and bends every joint.
fn moving(skeleton: &Skeleton, frames: usize) -> Clip {
    let pose = |frame: usize| {
        let time = frame as f64 / 10.0;
        let mut pose = skeleton.rest_pose();
        for (joint, rotation) in pose.rotations.iter_mut().enumerate() {
            let phase = time + joint as f64;
            let axis = DVec3::new(phase.sin(), 0.5, phase.cos()).normalize();
            *rotation = DQuat::from_axis_angle(axis, 0.4 * (0.7 * phase).sin());
        }
        for (joint, place) in skeleton.joints.iter().zip(&mut pose.translations) {
            if joint.parent.is_none() {
                *place += DVec3::new(3.0 * time, time.sin(), -time);
            }
        }
        pose
    };
    Clip {
        name: "moving".into(),
        skeleton: skeleton.clone(),
        frame_time: 1.0 / 30.0,
        poses: (0..frames).map(pose).collect(),
    }
}

fn recognised(skeleton: &Skeleton) -> BTreeMap<String, String> {
    let found = Recognised::of(skeleton).sources;
    let joints = DANCE_JOINTS.into_iter().zip(found);
    let found = joints.filter_map(|(joint, source)| Some((joint.to_string(), source?)));
    found.collect()
}

#[test]
fn the_joints_of_every_common_rig_are_recognised() {
    for rig in &RIGS {
        let body = rig.body();
        assert_eq!(recognised(&body.skeleton), body.sources, "{}", rig.name);
    }
}

#[test]
fn any_prefix_and_any_spelling_of_sides_will_do() {
    let body = RIGS[0].body();
    let renamed = |rename: &dyn Fn(&str) -> String| {
        let mut skeleton = body.skeleton.clone();
        for joint in &mut skeleton.joints {
            joint.name = rename(&joint.name);
        }
        let wanted = body.sources.iter();
        let wanted = wanted.map(|(joint, source)| (joint.clone(), rename(source)));
        assert_eq!(recognised(&skeleton), wanted.collect());
    };
    renamed(&|name| name.replace("mixamorig:", "mixamorig1:"));
    renamed(&|name| name.replace("mixamorig:", "Character1_"));
    renamed(&|name| name.replace("mixamorig:", "scene|Anna:"));
    renamed(&|name| name.replace("mixamorig:", "").to_lowercase());
    renamed(&|name| name.replace("mixamorig:", "").to_uppercase());
    renamed(&|name| {
        name.replace("mixamorig:Left", "L_")
            .replace("mixamorig:Right", "R_")
    });
}

#[test]
fn the_mapping_files_that_come_with_it_are_what_is_recognised() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/mappings");
    for (file, rig) in [
        ("mixamo", "mixamo"),
        ("rokoko", "rokoko"),
        ("xsens", "xsens"),
        ("perception_neuron", "perception_neuron"),
        ("bandai_namco", "bandai_namco"),
        ("rigify", "rigify"),
        ("lafan1", "lafan1"),
    ] {
        let clip = clip_of(rig);
        let shipped = Mapping::read(&folder.join(format!("{file}.toml"))).unwrap();
        let own = Mapping::recognised(&clip).unwrap();
        assert_eq!(
            shipped.apply(&clip).unwrap(),
            own.apply(&clip).unwrap(),
            "{file}"
        );
    }
}

/// Two frames on one of the rigs.
fn clip_of(rig: &str) -> Clip {
    let rig = RIGS.iter().find(|it| it.name == rig).unwrap();
    moving(&rig.body().skeleton, 2)
}

#[test]
fn the_mapping_of_the_cmu_clips_spreads_a_spine_of_two_joints_and_finds_all_others() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/mappings");
    let clip = clip_of("cmu_43");
    let shipped = Mapping::read(&folder.join("cmu.toml")).unwrap();
    let own = Mapping::recognised(&clip).unwrap();
    let [shipped, own] = [shipped, own].map(|it| it.apply(&clip).unwrap());
    for (a, b) in shipped.poses.iter().zip(&own.poses) {
        let [a, b] = [a, b].map(|pose| pose.world_positions(&own.skeleton));
        for (joint, name) in DANCE_JOINTS.iter().enumerate() {
            let apart = a[joint].distance(b[joint]);
            assert_eq!(apart > 1e-9, name.starts_with("Spine"), "{name}: {apart}");
        }
    }
}

#[test]
fn a_rig_without_hands_has_its_arms_and_its_trunk_all_the_same() {
    let body = RIGS[0].body();
    let joints = body.skeleton.joints.iter();
    let first_hand = |side: &str| {
        joints
            .clone()
            .position(|it| it.name.ends_with(side))
            .unwrap()
    };
    let hands = ["LeftHand", "RightHand"].map(first_hand);
    let mut skeleton = Skeleton { joints: Vec::new() };
    let mut places = BTreeMap::new();
    for (index, joint) in body.skeleton.joints.iter().enumerate() {
        let parent = joint.parent.map(|parent| places.get(&parent).copied());
        if hands.contains(&index) || parent == Some(None) {
            continue;
        }
        places.insert(index, skeleton.len());
        let mut joint = joint.clone();
        joint.parent = parent.flatten();
        if joint.name.ends_with("ForeArm") {
            joint.end_sites = vec![DVec3::X];
        }
        skeleton.joints.push(joint);
    }
    let mut expected = body.sources.clone();
    for side in ["Left", "Right"] {
        let forearm = expected[&format!("{side}ForeArm")].clone();
        expected.insert(format!("{side}Hand"), format!("{forearm}/End Site"));
    }
    assert_eq!(recognised(&skeleton), expected);
}

#[test]
fn what_is_not_found_is_named_and_stands_in_the_mapping_file_to_be_filled_in() {
    let mut skeleton = RIGS[0].body().skeleton;
    for joint in &mut skeleton.joints {
        if joint.name.ends_with("LeftForeArm") {
            joint.name = "tentacle".into();
        }
    }
    let found = Recognised::of(&skeleton);
    let trunk = [
        "Spine", "Spine1", "Spine2", "Spine3", "Spine4", "Neck", "Head",
    ];
    let missing = found.missing();
    assert!(missing.contains(&"LeftForeArm") && missing.contains(&"LeftArm"));
    assert!(trunk.iter().all(|joint| missing.contains(joint)));
    assert!(
        found
            .mapping_file("a.bvh")
            .contains("\n# LeftForeArm = \"?\"\n")
    );
    let clip = moving(&skeleton, 2);
    let error = Mapping::recognised(&clip).unwrap_err().to_string();
    assert!(error.contains("LeftForeArm"), "{error}");
}

fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    apart.fold(0.0, f64::max)
}

#[test]
fn a_motion_that_went_onto_the_dance_skeleton_comes_back_onto_its_rig() {
    for rig in &RIGS {
        let mut body = rig.body();
        body.skeleton.joints[0].offset.y += 2.0;
        let mut clip = moving(&body.skeleton, 40);
        let mapping = Mapping::recognised(&clip).unwrap();
        let turned_as = mapping.turned_as(&clip.skeleton);
        // Twist bones and the like between two joints stay as they are in their parents.
        for (joint, turned_as) in turned_as.iter().enumerate() {
            if turned_as.is_none() {
                for pose in &mut clip.poses {
                    pose.rotations[joint] = DQuat::IDENTITY;
                }
            }
        }
        let dance = mapping.apply(&clip).unwrap();
        let own = Rig {
            hips: mapping.hips(&clip.skeleton),
            moves: clip
                .skeleton
                .joints
                .iter()
                .map(|it| it.parent.is_none())
                .collect(),
            skeleton: clip.skeleton.clone(),
            turned_as,
        };
        let keyframe = |time: usize| RigKeyframe {
            time,
            pose: clip.poses[time].clone(),
            mapped: dance.poses[time].clone(),
            met: true,
        };
        let back = onto_rig(&dance, &own, &[0, 25, 39].map(keyframe));
        for (frame, (made, pose)) in back.poses.iter().zip(&clip.poses).enumerate() {
            let [made, pose] = [made, pose].map(|it: &Pose| it.world_positions(&own.skeleton));
            let apart = farthest(&made, &pose);
            assert!(apart < 1e-9, "{}, frame {frame}: {apart} cm", rig.name);
        }
    }
}

#[test]
fn fingers_go_from_their_pose_at_one_keyframe_to_that_at_the_next() {
    let clip = moving(&RIGS[0].body().skeleton, 11);
    let mapping = Mapping::recognised(&clip).unwrap();
    let dance = mapping.apply(&clip).unwrap();
    let own = Rig {
        hips: mapping.hips(&clip.skeleton),
        moves: vec![false; clip.skeleton.len()],
        turned_as: mapping.turned_as(&clip.skeleton),
        skeleton: clip.skeleton.clone(),
    };
    let keyframe = |time: usize| RigKeyframe {
        time,
        pose: clip.poses[time].clone(),
        mapped: dance.poses[time].clone(),
        met: true,
    };
    let made = onto_rig(&dance, &own, &[0, 10].map(keyframe));
    let finger = clip.skeleton.index_of("mixamorig:LeftHandIndex2").unwrap();
    let at = |frame: usize| made.poses[frame].rotations[finger];
    let [first, last] = [0, 10].map(|frame| clip.poses[frame].rotations[finger]);
    assert!(at(0).angle_between(first) < 1e-7 && at(10).angle_between(last) < 1e-7);
    let (way, half) = (first.angle_between(last), first.angle_between(at(5)));
    assert!(
        way > 0.05 && (half - way / 2.0).abs() < 1e-6,
        "{way} {half}"
    );
}

#[test]
fn a_keyframe_that_the_dance_does_not_meet_gives_the_fingers_alone() {
    let clip = moving(&RIGS[0].body().skeleton, 11);
    let mapping = Mapping::recognised(&clip).unwrap();
    let mapped = mapping.apply(&clip).unwrap();
    let own = Rig {
        hips: mapping.hips(&clip.skeleton),
        moves: vec![false; clip.skeleton.len()],
        turned_as: mapping.turned_as(&clip.skeleton),
        skeleton: clip.skeleton.clone(),
    };
    // The dance stands still; the pose at frame 10 is elsewhere.
    let mut dance = mapped.clone();
    dance.poses = vec![mapped.poses[0].clone(); 11];
    let keyframe = |time: usize, met: bool| RigKeyframe {
        time,
        pose: clip.poses[time].clone(),
        mapped: mapped.poses[time].clone(),
        met,
    };
    let made = |met: bool| onto_rig(&dance, &own, &[keyframe(0, true), keyframe(10, met)]);
    let turn = |made: &Clip, joint: &str, frame: usize| {
        let joint = clip.skeleton.index_of(joint).unwrap();
        let (_, from) = clip.poses[frame].world(&clip.skeleton);
        let (_, to) = made.poses[10].world(&clip.skeleton);
        from[joint].angle_between(to[joint])
    };
    assert!(turn(&made(true), "mixamorig:LeftArm", 10) < 1e-7);
    assert!(turn(&made(false), "mixamorig:LeftArm", 0) < 1e-7);
    let finger = clip.skeleton.index_of("mixamorig:LeftHandIndex2").unwrap();
    let [there, wanted] = [&made(false).poses[10], &clip.poses[10]];
    assert!(there.rotations[finger].angle_between(wanted.rotations[finger]) < 1e-7);
}

#[test]
fn poses_come_from_another_rest_pose_to_the_same_places() {
    let config = ChoreographyConfig {
        clips: 2,
        frames_per_clip: 60,
        seed: 5,
    };
    for dance in generate(&config).unwrap() {
        let clip = dance.clip;
        let directions = rest_directions(&clip.skeleton);
        let rest = RestPose {
            skeleton: &clip.skeleton,
            directions: &directions,
        };
        let other = from_another_rest_pose(&clip);
        assert!(rest.is_of(&clip.skeleton) && !rest.is_of(&other.skeleton));
        let (stood, poses) = rest.onto(&other.skeleton, &other.poses).unwrap();
        assert!(rest.is_of(&stood));
        for (pose, recorded) in poses.iter().zip(&clip.poses) {
            let places = recorded.world_positions(&clip.skeleton);
            assert!(farthest(&pose.world_positions(&stood), &places) < 1e-6);
        }
        assert!(rest.onto(&other.skeleton, &[]).is_err());
    }
}

#[test]
fn another_rate_keeps_keyframes_on_whole_frames() {
    let clip = moving(&RIGS[0].body().skeleton, 62);
    let times = nearest_frames(&[0, 31, 61], 0.8);
    assert_eq!(times, [0, 25, 49]);
    let own = spread(clip.clone(), &[0, 31, 61], &times, 1.0 / 24.0);
    assert_eq!((own.poses.len(), own.frame_time), (50, 1.0 / 24.0));
    for (new, old) in times.into_iter().zip([0, 31, 61]) {
        assert_eq!(own.poses[new], clip.poses[old], "frame {new}");
    }
    let fine = spread(clip.clone(), &[0, 61], &[0, 244], 1.0 / 120.0);
    assert_eq!(nearest_frames(&[3, 4, 5], 0.2), [1, 2, 3]);
    assert_eq!(fine.poses.len(), 245);
    assert_eq!(fine.poses[40], clip.poses[10]);
}

#[test]
fn units_and_axes_are_undone_as_they_were_applied() {
    let body = RIGS[0].body();
    let upright = moving(&body.skeleton, 5);
    let mut lying = upright.clone();
    for (joint, pose) in (0..5).flat_map(|_| 0..1).zip(&mut lying.poses) {
        pose.rotations[joint] = DQuat::from_rotation_x(1.5) * pose.rotations[joint];
    }
    for (clip, unit, up) in [
        (upright.clone(), Unit::M, Up::Z),
        (lying, Unit::In, Up::Z),
        (upright, Unit::Mm, Up::Y),
    ] {
        let mut converted = clip.clone();
        let (conversion, _) = Conversion::of(&clip, unit, up);
        conversion.apply(&mut converted);
        assert_ne!(converted, clip);
        conversion.undo(&mut converted);
        for (back, pose) in converted.poses.iter().zip(&clip.poses) {
            let [back, pose] = [(back, &converted), (pose, &clip)]
                .map(|(pose, clip)| pose.world_positions(&clip.skeleton));
            assert!(farthest(&back, &pose) < 1e-9);
        }
    }
}

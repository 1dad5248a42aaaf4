//! A person's own rig through the binary: recognised, danced on, written as it was read.

use std::fs;
use std::path::Path;
use std::process::Output;

use clap::CommandFactory as _;
use glam::{DQuat, DVec3};
use keydance::cli::Cli;
use keydance::motion::bvh::{self, Axis, Bvh, Channel, channel_layout};
use keydance::motion::{Clip, DANCE_JOINTS, Mapping, Recognised};
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::rigs::RIGS;
use crate::small_run::{keydance, stderr};
use crate::song::FIXTURE;

const FPS: f64 = 24.0;

/// A rig as a Blender user may have it: in metres, Z up, 24 frames a second, 61 frames.
fn own_clip(rig: usize) -> Bvh {
    let mut skeleton = RIGS[rig].body().skeleton;
    let z_up = |place: DVec3| DVec3::new(place.x, -place.z, place.y) / 100.0;
    for joint in &mut skeleton.joints {
        joint.offset = z_up(joint.offset);
        joint.end_sites.iter_mut().for_each(|end| *end = z_up(*end));
    }
    let pose = |frame: usize| {
        let time = frame as f64 / FPS;
        let mut pose = skeleton.rest_pose();
        for (joint, rotation) in pose.rotations.iter_mut().enumerate() {
            let swing = 0.2 * (2.0 * time + joint as f64).sin();
            *rotation = DQuat::from_rotation_z(swing) * DQuat::from_rotation_x(0.5 * swing);
        }
        pose.translations[0] += DVec3::new(0.1 * time, -0.2 * time, 0.02 * time.sin());
        pose
    };
    let clip = Clip {
        name: "own.bvh".into(),
        frame_time: 1.0 / FPS,
        poses: (0..61).map(pose).collect(),
        skeleton,
    };
    let order = [Axis::X, Axis::Y, Axis::Z];
    Bvh::from_clip(&clip, channel_layout(&clip, order)).unwrap()
}

fn config() -> String {
    let folder = env!("CARGO_MANIFEST_DIR");
    format!("{folder}/experiments/pan2021/interpolation.toml")
}

/// `keydance generate` in a folder, by interpolation, into dance.bvh.
fn generate(folder: &Path, more: &[&str]) -> Output {
    let mut command = keydance();
    command.current_dir(folder).args(["generate", &config()]);
    command
        .args(["--out", "dance.bvh"])
        .args(more)
        .output()
        .unwrap()
}

/// The dance of a generation that succeeds.
fn danced(folder: &Path, more: &[&str]) -> Bvh {
    let output = generate(folder, more);
    assert!(output.status.success(), "{more:?}: {}", stderr(&output));
    bvh::read(&folder.join("dance.bvh")).unwrap()
}

fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| a.distance(*b));
    apart.fold(0.0, f64::max)
}

#[test]
fn a_dance_between_keyframes_of_any_rig_is_on_that_rig_in_its_unit_axis_channels_and_rate() {
    for (number, rig) in RIGS.iter().enumerate() {
        let folder = TempDir::new().unwrap();
        let own = folder.path().join("own.bvh");
        bvh::write(&own, &own_clip(number)).unwrap();
        let document = bvh::read(&own).unwrap();
        // 25, 50 and 75 at 30 frames a second are 20, 40 and 60 of the file's.
        let keyframes = [
            "--motion",
            "own.bvh",
            "--keyframes",
            "0,25,50,75",
            "--foot-cleanup",
        ];
        let said = stderr(&generate(folder.path(), &keyframes));
        assert!(said.contains("the result is on it"), "{}: {said}", rig.name);
        let made = bvh::read(&folder.path().join("dance.bvh")).unwrap();
        assert_eq!(
            made.skeleton().joints.len(),
            document.skeleton().joints.len()
        );
        assert_eq!(made.channels(), document.channels(), "{}", rig.name);
        assert!((made.frame_time() * FPS - 1.0).abs() < 1e-6);
        assert_eq!(made.frames(), 61);
        let (made, document) = (made.to_clip(), document.to_clip());
        for frame in [0, 20, 40, 60] {
            let [a, b] =
                [&made, &document].map(|clip| clip.poses[frame].world_positions(&clip.skeleton));
            let apart = farthest(&a, &b);
            assert!(apart < 1e-5, "{}, frame {frame}: {apart} m", rig.name);
        }
    }
}

#[test]
fn a_dance_to_a_song_from_a_seed_of_any_rig_is_on_that_rig_in_its_unit_axis_channels_and_rate() {
    for (number, rig) in RIGS.iter().enumerate() {
        let folder = TempDir::new().unwrap();
        let [own, out] = ["own.bvh", "dance.bvh"].map(|name| folder.path().join(name));
        bvh::write(&own, &own_clip(number)).unwrap();
        let document = bvh::read(&own).unwrap();
        let mut command = FIXTURE.command("generate");
        command.arg("--music").arg(FIXTURE.file(0, "wav"));
        command
            .arg("--seed-motion")
            .arg(format!("{}:0", own.display()));
        command
            .arg("--keyframe")
            .arg(format!("{}:70@4s", own.display()));
        let output = command.arg("--out").arg(&out).output().unwrap();
        let said = stderr(&output);
        assert!(output.status.success(), "{}: {said}", rig.name);
        assert!(said.contains("the result is on it"), "{}: {said}", rig.name);
        let made = bvh::read(&out).unwrap();
        assert_eq!(made.skeleton(), document.skeleton(), "{}", rig.name);
        assert_eq!(made.channels(), document.channels(), "{}", rig.name);
        assert!((made.frame_time() * FPS - 1.0).abs() < 1e-6);
        assert_eq!(made.frames(), 192);
        let (made, document) = (made.to_clip(), document.to_clip());
        let arms = ["LeftArm", "RightArm"].map(|joint| {
            let at = DANCE_JOINTS.iter().position(|it| *it == joint).unwrap();
            let name = Recognised::of(&document.skeleton).sources[at]
                .clone()
                .unwrap();
            document.skeleton.index_of(&name).unwrap()
        });
        let shoulders = made.poses.iter().map(|pose| {
            let places = pose.world_positions(&made.skeleton);
            places[arms[0]].distance(places[arms[1]])
        });
        let shoulders: Vec<f64> = shoulders.collect();
        let narrowest = shoulders.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(
            narrowest > 0.7 * shoulders[0],
            "{}: {shoulders:?} m",
            rig.name
        );
        // The seed has 60 frames at 30 a second; each fourth of the file's is one of them.
        for frame in (0..48).step_by(4) {
            let [a, b] =
                [&made, &document].map(|clip| clip.poses[frame].world_positions(&clip.skeleton));
            let apart = farthest(&a, &b);
            assert!(apart < 1e-5, "{}, frame {frame}: {apart} m", rig.name);
        }
    }
}

#[test]
fn frames_counted_at_the_files_own_rate_are_met_exactly_as_it_has_them() {
    let folder = TempDir::new().unwrap();
    let own = folder.path().join("own.bvh");
    bvh::write(&own, &own_clip(0)).unwrap();
    let recorded = bvh::read(&own).unwrap().to_clip();
    let own_frames = |more: &[&str]| {
        let motion = ["--motion", "own.bvh", "--own-frames", "--force"];
        danced(folder.path(), &[&motion, more].concat()).to_clip()
    };
    let is_met = |made: &Clip, time: usize, row: usize| {
        let [a, b] = [(made, time), (&recorded, row)]
            .map(|(clip, frame)| clip.poses[frame].world_positions(&clip.skeleton));
        let apart = farthest(&a, &b);
        assert!(apart < 1e-5, "row {row} at frame {time}: {apart} m");
    };
    let made = own_frames(&["--keyframes", "3,13,37,59"]);
    assert_eq!(made.poses.len(), 57);
    for row in [3, 13, 37, 59] {
        is_met(&made, row - 3, row);
    }
    // Three rows made by hand, an odd number of frames from one to the next.
    let by_hand = [
        "--keyframes",
        "4,5,6",
        "--length",
        "31,47",
        "--json",
        "dance.json",
    ];
    let made = own_frames(&by_hand);
    let json = folder.path().join("dance.json");
    let said: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    let frames = said["keyframes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|it| it["frame"].as_u64());
    assert!(frames.eq([Some(0), Some(31), Some(78)]), "{said}");
    assert_eq!(said["frames"], 79);
    assert_eq!(made.poses.len(), 79);
    for (row, time) in [(4, 0), (5, 31), (6, 78)] {
        is_met(&made, time, row);
    }
    let beyond = [
        "--motion",
        "own.bvh",
        "--own-frames",
        "--keyframes",
        "0,61",
        "--force",
    ];
    let said = stderr(&generate(folder.path(), &beyond));
    assert!(
        said.contains("has no frame 61: its frames are 0 to 60 at 24"),
        "{said}"
    );
}

#[test]
fn the_dance_skeleton_itself_keeps_its_unit_where_its_own_frames_count() {
    let folder = TempDir::new().unwrap();
    write_clips(folder.path(), 60, 3);
    let clips = fs::read_dir(folder.path()).unwrap();
    let file = clips.map(|clip| clip.unwrap().path()).min().unwrap();
    let mut clip = bvh::read(&file).unwrap().to_clip();
    for joint in &mut clip.skeleton.joints {
        joint.offset /= 100.0;
        joint.end_sites.iter_mut().for_each(|end| *end /= 100.0);
    }
    let places = clip
        .poses
        .iter_mut()
        .flat_map(|pose| &mut pose.translations);
    places.for_each(|place| *place /= 100.0);
    let channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
    bvh::write(&file, &Bvh::from_clip(&clip, channels).unwrap()).unwrap();
    let name = file.file_name().unwrap().to_str().unwrap();
    let keyframes = ["--motion", name, "--own-frames", "--keyframes", "5,40"];
    let made = danced(folder.path(), &keyframes).to_clip();
    let [a, b] = [(&made, 35), (&clip, 40)]
        .map(|(clip, frame)| clip.poses[frame].world_positions(&clip.skeleton));
    assert!(farthest(&a, &b) < 1e-5);
}

#[test]
fn a_taller_dancers_keyframe_on_the_same_rig_is_put_onto_the_first_ones_bones() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let document = own_clip(0);
    bvh::write(&path("own.bvh"), &document).unwrap();
    let mut tall = document.to_clip();
    for joint in &mut tall.skeleton.joints {
        joint.offset *= 1.1;
        joint.end_sites.iter_mut().for_each(|end| *end *= 1.1);
    }
    let places = tall
        .poses
        .iter_mut()
        .flat_map(|pose| &mut pose.translations);
    places.for_each(|place| *place *= 1.1);
    let channels = document.channels().to_vec();
    bvh::write(&path("tall.bvh"), &Bvh::from_clip(&tall, channels).unwrap()).unwrap();
    let keyframes = ["--keyframe", "own.bvh:0@0", "--keyframe", "tall.bvh:50@50"];
    let made = danced(folder.path(), &keyframes).to_clip();
    let tall = bvh::read(&path("tall.bvh")).unwrap().to_clip();
    let own = bvh::read(&path("own.bvh")).unwrap();
    assert_eq!(made.skeleton, *own.skeleton());
    let [a, b] =
        [(&made, made.poses.len() - 1), (&tall, 40)].map(|(clip, frame)| &clip.poses[frame]);
    for (joint, (a, b)) in a.rotations.iter().zip(&b.rotations).enumerate() {
        assert!(a.angle_between(*b) < 1e-5, "joint {joint}");
    }
}

#[test]
fn a_joint_that_has_to_turn_gets_the_channels_that_its_file_lacks() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut clip = own_clip(0).to_clip();
    bvh::write(&path("turns.bvh"), &own_clip(0)).unwrap();
    let joint = |name: &str| {
        clip.skeleton
            .index_of(&format!("mixamorig:{name}"))
            .unwrap()
    };
    let (finger, spine) = (joint("LeftHandIndex1"), joint("Spine"));
    let mut channels = channel_layout(&clip, [Axis::Z, Axis::X, Axis::Y]);
    for joint in [finger, spine] {
        clip.poses
            .iter_mut()
            .for_each(|pose| pose.rotations[joint] = DQuat::IDENTITY);
        channels[joint].clear();
    }
    let stiff = Bvh::from_clip(&clip, channels).unwrap();
    bvh::write(&path("stiff.bvh"), &stiff).unwrap();
    let made = danced(
        folder.path(),
        &["--motion", "stiff.bvh", "--keyframes", "0,75"],
    );
    assert_eq!(
        made.channels()[made
            .skeleton()
            .index_of("mixamorig:LeftHandIndex1")
            .unwrap()],
        []
    );
    let keyframes = [
        "--keyframe",
        "stiff.bvh:0@0",
        "--keyframe",
        "turns.bvh:50@50",
        "--force",
    ];
    let made = danced(folder.path(), &keyframes);
    let spine = made.skeleton().index_of("mixamorig:Spine").unwrap();
    let rotations = [Axis::Z, Axis::X, Axis::Y].map(Channel::Rotation);
    assert_eq!(made.channels()[spine], rotations);
}

#[test]
fn a_joint_that_turns_about_one_axis_is_said_to_turn_about_three() {
    let folder = TempDir::new().unwrap();
    let document = own_clip(0);
    let knee = document.skeleton().index_of("mixamorig:LeftLeg").unwrap();
    let before: usize = document.channels()[..knee].iter().map(Vec::len).sum();
    let mut channels = document.channels().to_vec();
    channels[knee].truncate(1);
    let columns: Vec<usize> = (0..document.motion().ncols())
        .filter(|column| ![before + 1, before + 2].contains(column))
        .collect();
    let motion = document.motion().select(ndarray::Axis(1), &columns);
    let skeleton = document.skeleton().clone();
    let bent = Bvh::new("own.bvh".into(), skeleton, channels, 1.0 / FPS, motion).unwrap();
    bvh::write(&folder.path().join("own.bvh"), &bent).unwrap();
    let said = stderr(&generate(
        folder.path(),
        &["--motion", "own.bvh", "--keyframes", "0,75"],
    ));
    assert!(
        said.contains("turns about three in the result: mixamorig:LeftLeg"),
        "{said}"
    );
    let made = bvh::read(&folder.path().join("dance.bvh")).unwrap();
    let knee = made.skeleton().index_of("mixamorig:LeftLeg").unwrap();
    assert_eq!(made.channels()[knee].len(), 3);
}

#[test]
fn a_rig_that_is_not_recognised_is_mapped_by_a_file_that_the_program_began() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let text = own_clip(0)
        .to_text()
        .replace("mixamorig:LeftForeArm", "tentacle");
    fs::write(path("own.bvh"), text).unwrap();
    let generated = |more: &[&str]| {
        let keyframes = ["--motion", "own.bvh", "--keyframes", "0,75"];
        generate(folder.path(), &[&keyframes, more].concat())
    };
    let refused = generated(&[]);
    assert!(!refused.status.success());
    let said = stderr(&refused);
    assert!(
        said.contains("LeftForeArm") && said.contains("keydance rig"),
        "{said}"
    );
    let mut rig = keydance();
    rig.current_dir(folder.path())
        .args(["rig", "own.bvh", "--out", "map.toml"]);
    let output = assert_cmd::Command::from_std(rig).assert().success();
    output.stdout(contains("LeftForeArm    not found"));
    // What a person does: a right side that was found says what the left one is called.
    let whole = RIGS[0].body().sources;
    let mut lines = String::from("[joints]\n");
    for joint in DANCE_JOINTS {
        let source = whole[joint].replace("mixamorig:LeftForeArm", "tentacle");
        lines += &format!("{joint} = \"{source}\"\n");
    }
    let begun = fs::read_to_string(path("map.toml")).unwrap();
    let kept: Vec<&str> = begun
        .lines()
        .filter(|line| line.contains(" = \"mixamo"))
        .collect();
    assert!(!kept.is_empty() && kept.iter().all(|line| lines.contains(line)));
    fs::write(path("map.toml"), lines).unwrap();
    assert!(Mapping::read(&path("map.toml")).is_ok());
    let output = generated(&["--mapping", "map.toml"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let made = bvh::read(&path("dance.bvh")).unwrap();
    assert!(made.skeleton().index_of("tentacle").is_some());
}

#[test]
fn a_mapping_with_sides_swapped_or_one_for_both_is_told() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("own.bvh"), own_clip(0).to_text()).unwrap();
    let whole = RIGS[0].body().sources;
    let mapped = |source: &dyn Fn(&str) -> String| {
        let lines = DANCE_JOINTS.map(|joint| format!("{joint} = \"{}\"\n", source(joint)));
        fs::write(path("map.toml"), format!("[joints]\n{}", lines.concat())).unwrap();
        let options = [
            "--motion",
            "own.bvh",
            "--keyframes",
            "0,40",
            "--mapping",
            "map.toml",
        ];
        generate(folder.path(), &options)
    };
    let output = mapped(&|joint| {
        let one = joint.replace("LeftHand", "RightHand");
        whole[&one].clone()
    });
    assert!(!output.status.success() && !path("dance.bvh").exists());
    let said = stderr(&output);
    assert!(
        said.contains("LeftHand and RightHand are mapped to one place"),
        "{said}"
    );
    let output = mapped(&|joint| {
        let other = match joint.strip_prefix("Left") {
            Some(part) => format!("Right{part}"),
            None => joint.replace("Right", "Left"),
        };
        whole[&other].clone()
    });
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("the toes point backwards"),
        "{}",
        stderr(&output)
    );
    fs::remove_file(path("dance.bvh")).unwrap();
    let output = mapped(&|joint| match joint.contains("Leg") {
        true => {
            let other = match joint.strip_prefix("Left") {
                Some(part) => format!("Right{part}"),
                None => joint.replace("Right", "Left"),
            };
            whole[&other].clone()
        }
        false => whole[joint].clone(),
    });
    assert!(
        stderr(&output).contains("face opposite ways"),
        "{}",
        stderr(&output)
    );
    fs::remove_file(path("dance.bvh")).unwrap();
    let output = mapped(&|joint| whole[joint].clone());
    assert!(!stderr(&output).contains("may be swapped"));
}

#[test]
fn pinned_feet_stay_above_the_floor_at_the_files_own_rate_and_on_its_rig() {
    let folder = TempDir::new().unwrap();
    let own = own_clip(0);
    fs::write(folder.path().join("own.bvh"), own.to_text()).unwrap();
    let sources = RIGS[0].body().sources;
    let lowest = |file: &Bvh, frames: usize| {
        let clip = file.to_clip();
        let world = clip.skeleton.world_positions(&clip.poses[..frames]);
        let toes = ["LeftToeBase", "RightToeBase"];
        let toes = toes.map(|toe| clip.skeleton.index_of(&sources[toe]).unwrap());
        let heights = world.iter().flat_map(|frame| toes.map(|toe| frame[toe].z));
        100.0 * heights.fold(f64::INFINITY, f64::min)
    };
    let options = [
        "--motion",
        "own.bvh",
        "--own-frames",
        "--keyframes",
        "0,20,60",
        "--raise=-30",
    ];
    let plain = danced(folder.path(), &options);
    fs::remove_file(folder.path().join("dance.bvh")).unwrap();
    let pinned = danced(folder.path(), &[&options[..], &["--foot-cleanup"]].concat());
    assert_eq!(pinned.frames(), 61);
    let floor = lowest(&own, 61);
    let below = [&plain, &pinned].map(|made| floor - lowest(made, 61));
    assert!(
        below[0] > 0.5 && below[1] < 0.01,
        "{below:?} cm below the floor"
    );
}

#[test]
fn rows_of_poses_that_are_counted_at_another_rate_than_their_files_get_a_hint() {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("own.bvh"), own_clip(0).to_text()).unwrap();
    let rows = [
        "--motion",
        "own.bvh",
        "--keyframes",
        "0,2",
        "--length",
        "40",
    ];
    let said = stderr(&generate(folder.path(), &rows));
    assert!(said.contains("frame 2 is its frame 1.6"), "{said}");
    fs::remove_file(folder.path().join("dance.bvh")).unwrap();
    let said = stderr(&generate(
        folder.path(),
        &[&rows[..], &["--own-frames"]].concat(),
    ));
    assert!(!said.contains("is its frame"), "{said}");
}

#[test]
fn completions_and_man_pages_know_every_command() {
    let commands = Cli::command();
    let names: Vec<&str> = commands.get_subcommands().map(|it| it.get_name()).collect();
    assert!(names.len() > 20);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = keydance().args(["completions", shell]).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let unknown: Vec<&&str> = names.iter().filter(|name| !text.contains(**name)).collect();
        assert!(unknown.is_empty(), "{shell}: {unknown:?}");
    }
    let folder = TempDir::new().unwrap();
    let pages = folder.path().join("man/man1");
    let man = |more: &[&str]| {
        keydance()
            .arg("man")
            .arg(&pages)
            .args(more)
            .output()
            .unwrap()
    };
    assert!(man(&[]).status.success());
    for name in names {
        let page = fs::read_to_string(pages.join(format!("keydance-{name}.1"))).unwrap();
        assert!(page.contains("keydance"), "{name}");
    }
    let main = pages.join("keydance.1");
    fs::write(&main, "another").unwrap();
    assert!(stderr(&man(&[])).contains("--force replaces it"));
    assert_eq!(fs::read_to_string(&main).unwrap(), "another");
    assert!(man(&["--force"]).status.success());
    assert_ne!(fs::read_to_string(&main).unwrap(), "another");
}

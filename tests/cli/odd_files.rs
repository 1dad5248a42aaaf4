//! Files and folders from other programs, through the binary: what it says of them, and that the
//! motion is theirs.

use std::fs;
use std::path::{Path, PathBuf};

use glam::{DQuat, DVec3};
use keydance::motion::Clip;
use keydance::motion::bvh::{self, Axis, Bvh, channel_layout};
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::small_run::{SmallRun, keydance, stderr};

/// The config of a model that needs no training.
fn interpolation() -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    format!("{root}/experiments/pan2021/interpolation.toml")
}

fn paths(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

/// A folder with six generated clips.
fn clips(frames: usize) -> (TempDir, Vec<PathBuf>) {
    let folder = TempDir::new().unwrap();
    write_clips(folder.path(), frames, 3);
    let paths = paths(folder.path());
    (folder, paths)
}

fn write(path: &Path, clip: &Clip) {
    let channels = channel_layout(clip, [Axis::Z, Axis::X, Axis::Y]);
    bvh::write(path, &Bvh::from_clip(clip, channels).unwrap()).unwrap();
}

/// The clip in metres and with Z up, as Blender writes it.
fn as_blender_writes(mut clip: Clip) -> Clip {
    let turn = |v: DVec3| DVec3::new(v.x, -v.z, v.y);
    for joint in &mut clip.skeleton.joints {
        joint.offset = turn(joint.offset) / 100.0;
        for end in &mut joint.end_sites {
            *end = turn(*end) / 100.0;
        }
    }
    for pose in &mut clip.poses {
        for place in &mut pose.translations {
            *place = turn(*place) / 100.0;
        }
        for q in &mut pose.rotations {
            let axis = turn(DVec3::new(q.x, q.y, q.z));
            *q = DQuat::from_xyzw(axis.x, axis.y, axis.z, q.w);
        }
    }
    clip
}

fn features(clip: &Path, npy: &Path, more: &[&str]) -> (Vec<f32>, String) {
    let mut command = keydance();
    command.args(["features", "--force"]);
    command.arg(clip).arg("--npy").arg(npy);
    let output = command.args(more).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let array: ndarray::Array2<f32> = ndarray_npy::read_npy(npy).unwrap();
    (array.into_iter().collect(), stderr(&output))
}

#[test]
fn metres_with_z_up_have_the_features_of_the_clip_and_are_named_unless_declared() {
    let (folder, paths) = clips(60);
    let odd = folder.path().join("odd.bvh");
    write(
        &odd,
        &as_blender_writes(bvh::read(&paths[0]).unwrap().to_clip()),
    );
    let npy = folder.path().join("x.npy");
    let (expected, said) = features(&paths[0], &npy, &[]);
    assert_eq!(said, "");
    let declared = ["--unit", "m", "--up", "z"];
    for (more, words) in [(&[][..], true), (&declared[..], false)] {
        let (found, said) = features(&odd, &npy, more);
        let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f32::max) < 1e-3);
        for word in [
            "warning: odd.bvh: the body is",
            "taken as m and",
            "stands along Z",
        ] {
            assert_eq!(said.contains(word), words, "{said}");
        }
    }
    for (more, lines) in [
        (
            &[][..],
            [
                "unit         m, as the body is 1.",
                "up           Z, as the body stands",
            ],
        ),
        (
            &declared[..],
            ["unit         m, as declared", "up           Z, as declared"],
        ),
    ] {
        let mut command = keydance();
        let output = command
            .args(["bvh", "inspect"])
            .arg(&odd)
            .args(more)
            .output()
            .unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert!(lines.iter().all(|line| text.contains(line)), "{text}");
    }
    let wrong = keydance()
        .args(["features", "x.bvh", "--npy", "x", "--unit", "ell"])
        .output();
    assert!(stderr(&wrong.unwrap()).contains("expected auto, cm, m, mm or in"));
}

#[test]
fn keyframes_in_metres_with_z_up_stand_where_the_file_has_them() {
    let (folder, paths) = clips(60);
    let clip = bvh::read(&paths[0]).unwrap().to_clip();
    let (odd, out) = (folder.path().join("odd.bvh"), folder.path().join("out.bvh"));
    write(&odd, &as_blender_writes(clip.clone()));
    let output = keydance()
        .args(["generate", &interpolation(), "--keyframe"])
        .arg(format!("{}:0@0", paths[0].display()))
        .arg("--keyframe")
        .arg(format!("{}:40@20", odd.display()))
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("odd.bvh: the body is"),
        "{}",
        stderr(&output)
    );
    let result = bvh::read(&out).unwrap().to_clip();
    let world = |clip: &Clip, frame: usize| clip.poses[frame].world_positions(&clip.skeleton);
    for (found, expected) in world(&result, 20).iter().zip(world(&clip, 40)) {
        assert!(found.distance(expected) < 0.01, "{found} is not {expected}");
    }
    let text = fs::read_to_string(&out).unwrap();
    let motion = text.split_once("Frame Time").unwrap().1;
    let numbers = motion.split_whitespace().skip(2);
    for number in numbers {
        assert!(
            number.bytes().all(|byte| b"-.0123456789".contains(&byte)),
            "{number}"
        );
        assert_ne!(number, "-0.000000000");
    }
}

#[test]
fn keyframes_of_another_size_or_rest_pose_are_refused_in_any_unit() {
    let (folder, paths) = clips(60);
    let clip = bvh::read(&paths[0]).unwrap().to_clip();
    let (odd, out) = (folder.path().join("odd.bvh"), folder.path().join("out.bvh"));
    let generate = |first: &Path, more: &[&str]| {
        let output = keydance()
            .args(["generate", &interpolation(), "--keyframe"])
            .arg(format!("{}:0@0", first.display()))
            .arg("--keyframe")
            .arg(format!("{}:40@20", odd.display()))
            .arg("--out")
            .arg(&out)
            .args(more)
            .output()
            .unwrap();
        assert!(!output.status.success() && !out.exists());
        stderr(&output)
    };
    // The legs point sideways at rest; all in metres.
    let mut other = as_blender_writes(clip.clone());
    other.skeleton.joints[2].offset = DVec3::X * other.skeleton.joints[2].offset.length();
    let joint = &other.skeleton.joints[2];
    let translation = joint.offset;
    for pose in &mut other.poses {
        pose.translations[2] = translation;
    }
    write(&odd, &other);
    assert!(generate(&paths[0], &[]).contains("stands on another rest pose"));
    let metres = folder.path().join("metres.bvh");
    write(&metres, &as_blender_writes(clip.clone()));
    let as_they_are = ["--unit", "cm", "--up", "y"];
    assert!(generate(&metres, &as_they_are).contains("stands on another rest pose"));
    let mut small = clip;
    for joint in &mut small.skeleton.joints {
        joint.offset /= 100.0;
    }
    for pose in &mut small.poses {
        for place in &mut pose.translations {
            *place /= 100.0;
        }
    }
    write(&odd, &small);
    let said = generate(&paths[0], &as_they_are);
    assert!(
        said.contains("0.010 times as long") && said.contains("declare"),
        "{said}"
    );
}

#[test]
fn a_result_is_in_the_unit_and_axis_of_its_file_on_the_dance_skeleton_too() {
    let (folder, paths) = clips(60);
    let odd = folder.path().join("odd.bvh");
    let as_written = as_blender_writes(bvh::read(&paths[0]).unwrap().to_clip());
    write(&odd, &as_written);
    let out = folder.path().join("out.bvh");
    let output = keydance()
        .args(["generate", &interpolation(), "--keyframes", "0,20,50"])
        .arg("--motion")
        .arg(&odd)
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let result = bvh::read(&out).unwrap().to_clip();
    let world = |clip: &Clip, frame: usize| clip.poses[frame].world_positions(&clip.skeleton);
    for frame in [0, 20, 50] {
        let pairs = world(&result, frame)
            .into_iter()
            .zip(world(&as_written, frame));
        for (found, expected) in pairs {
            assert!(found.distance(expected) < 1e-4, "{found} is not {expected}");
        }
    }
}

#[test]
fn a_mapping_with_a_scale_is_heeded_on_the_dance_skeleton_too() {
    let (folder, paths) = clips(60);
    let (small, npy) = (folder.path().join("small.bvh"), folder.path().join("x.npy"));
    let mut clip = bvh::read(&paths[0]).unwrap().to_clip();
    let joints = clip.skeleton.joints.iter_mut();
    joints.for_each(|joint| joint.offset /= 10.0);
    let poses = clip
        .poses
        .iter_mut()
        .flat_map(|pose| &mut pose.translations);
    poses.for_each(|place| *place /= 10.0);
    write(&small, &clip);
    let mapping = folder.path().join("decimetres.toml");
    let names = clip.skeleton.joints.iter().map(|joint| &joint.name);
    let names: String = names.map(|name| format!("{name} = '{name}'\n")).collect();
    fs::write(&mapping, format!("scale = 10.0\n[joints]\n{names}")).unwrap();
    let (expected, _) = features(&paths[0], &npy, &[]);
    let (found, said) = features(&small, &npy, &["--mapping", mapping.to_str().unwrap()]);
    let apart = found.iter().zip(&expected).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f32::max) < 1e-3, "{said}");
    assert_eq!(said, "");
    // One of another rig is not for this clip.
    let other = fs::read_to_string(&mapping)
        .unwrap()
        .replace(" = '", " = 'rig:");
    fs::write(&mapping, other).unwrap();
    let (found, _) = features(&paths[0], &npy, &["--mapping", mapping.to_str().unwrap()]);
    assert_eq!(found, expected);
}

#[test]
fn a_keyframe_on_a_slightly_other_rest_pose_is_told_with_its_degrees() {
    let (folder, paths) = clips(60);
    let mut other = bvh::read(&paths[0]).unwrap().to_clip();
    let turn = DQuat::from_rotation_z(0.35);
    for joint in [16, 17] {
        let bone = turn * other.skeleton.joints[joint].offset;
        other.skeleton.joints[joint].offset = bone;
        other
            .poses
            .iter_mut()
            .for_each(|pose| pose.translations[joint] = bone);
    }
    let odd = folder.path().join("odd.bvh");
    write(&odd, &other);
    let output = keydance()
        .args(["generate", &interpolation(), "--keyframe"])
        .arg(format!("{}:0@0", paths[0].display()))
        .arg("--keyframe")
        .arg(format!("{}:40@20", odd.display()))
        .arg("--out")
        .arg(folder.path().join("out.bvh"))
        .output()
        .unwrap();
    let said = stderr(&output);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("points 20 degrees elsewhere at rest than in"),
        "{said}"
    );
}

#[test]
fn a_recorder_that_rounds_30_frames_a_second_to_0_033_has_all_its_frames() {
    let (folder, paths) = clips(60);
    let (rounded, npy) = (
        folder.path().join("rounded.bvh"),
        folder.path().join("x.npy"),
    );
    let text = fs::read_to_string(&paths[0]).unwrap();
    let time = text
        .lines()
        .find(|line| line.starts_with("Frame Time"))
        .unwrap();
    fs::write(
        &rounded,
        text.replace(time, "Frame Time: 0.033").replace('\n', "\r"),
    )
    .unwrap();
    let (expected, _) = features(&paths[0], &npy, &[]);
    let (found, said) = features(&rounded, &npy, &[]);
    assert_eq!(found, expected);
    assert!(
        said.contains("0.033 s is taken for 30 frames a second"),
        "{said}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_data_folder_may_hold_names_that_are_not_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt as _;
    let small = SmallRun::new();
    let first = paths(&small.path("data")).remove(0);
    fs::rename(
        first,
        small.path("data").join(OsStr::from_bytes(b"caf\xe9.bvh")),
    )
    .unwrap();
    let output = small.train(&small.path("run"), &["--set", "schedule.fraction=0.05"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let named = |frame: &str| {
        let mut name = small.path("data").join("").into_os_string();
        name.push(OsStr::from_bytes(b"caf\xe9.bvh"));
        name.push(frame);
        name
    };
    let output = keydance()
        .args(["generate", &interpolation(), "--keyframe"])
        .arg(named(":0@0"))
        .arg("--keyframe")
        .arg(named(":40@1s"))
        .arg("--velocity-from")
        .arg(named(":3"))
        .arg("--out")
        .arg(small.path("out.bvh"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn training_says_what_is_odd_about_a_folder_and_refuses_to_test_on_what_it_trains_on() {
    let small = SmallRun::new();
    let data = small.path("data");
    let files = paths(&data);
    let train = |run: &str, more: &[&str]| {
        let more = [&["--set", "schedule.fraction=0.05"], more].concat();
        small.train(&small.path(run), &more)
    };
    let quiet = train("quiet", &[]);
    assert!(!stderr(&quiet).contains("warning"), "{}", stderr(&quiet));
    let clip = |file: &PathBuf| bvh::read(file).unwrap().to_clip();
    for file in &files[..2] {
        write(file, &as_blender_writes(clip(file)));
    }
    fs::create_dir(data.join("more")).unwrap();
    fs::copy(&files[3], data.join("more/further.bvh")).unwrap();
    // The same motion in another file: other names, other line ends, a copy in metres.
    let list = |train: &[&Path], test: &[&Path]| {
        let names = |files: &[&Path]| -> String {
            let names = files
                .iter()
                .map(|file| file.file_name().unwrap().to_str().unwrap());
            format!(
                "[{}]",
                names
                    .map(|name| format!("'{name}'"))
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        };
        format!(
            "data.split={{ list = {{ train = {}, test = {} }} }}",
            names(train),
            names(test)
        )
    };
    let copy = data.join("copy.bvh");
    write(&copy, &as_blender_writes(clip(&files[2])));
    let split = list(&[&files[0], &files[1], &files[2], &copy], &[&files[4]]);
    let odd = train("odd", &["--set", &split]);
    let said = stderr(&odd);
    assert!(odd.status.success(), "{said}");
    let name = |file: &Path| file.file_name().unwrap().to_str().unwrap().to_string();
    let units = format!(
        "{}, {}, copy.bvh: the body is",
        name(&files[0]),
        name(&files[1])
    );
    for words in [
        &units,
        "taken as m and converted",
        "stands along Z",
        "and copy.bvh are the same motion",
        "1 .bvh files in folders inside",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let split = list(&[&files[0], &files[2]], &[&copy]);
    let refused = train("refused", &["--set", &split]);
    assert!(!refused.status.success() && !small.path("refused").exists());
    let said = stderr(&refused);
    assert!(
        said.contains("are the same motion, one to train on and one to test on"),
        "{said}"
    );
}

#[test]
fn a_folder_whose_clips_lie_deeper_says_where() {
    let folder = TempDir::new().unwrap();
    let below = folder.path().join("a/b");
    fs::create_dir_all(&below).unwrap();
    write_clips(&below, 10, 3);
    let output = keydance()
        .args(["evaluate", &interpolation(), "--data"])
        .arg(folder.path())
        .output()
        .unwrap();
    let said = stderr(&output);
    assert!(
        said.contains("6 lie deeper, the first is") && said.contains("/a/b/"),
        "{said}"
    );
}

#[test]
fn a_header_of_another_rate_and_a_t_pose_are_mended_by_the_config() {
    let small = SmallRun::new();
    let data = small.path("data");
    for file in paths(&data) {
        let mut clip = bvh::read(&file).unwrap().to_clip();
        let mut t_pose = clip.poses[0].clone();
        t_pose.rotations[1..].fill(DQuat::IDENTITY);
        t_pose.rotations[0] = DQuat::from_rotation_y(2.0) * t_pose.rotations[0];
        clip.poses.insert(0, t_pose);
        clip.frame_time = 1.0 / 77.0;
        write(&file, &clip);
    }
    let fraction = "schedule.fraction=0.05";
    let as_is = small.train(&small.path("as_is"), &["--set", fraction]);
    assert!(
        stderr(&as_is).contains("data.skip_frames = 1"),
        "{}",
        stderr(&as_is)
    );
    let keys = ["--set", "data.source_fps=30", "--set", "data.skip_frames=1"];
    let mended = [&["--set", fraction], &keys[..]].concat();
    let mended = small.train(&small.path("mended"), &mended);
    assert!(!stderr(&mended).contains("warning"), "{}", stderr(&mended));
    let manifest = fs::read_to_string(small.path("mended").join("manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(manifest["train"]["frames"], 4 * 60);
}

//! `keydance generate` through the binary.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use glam::DVec3;
use keydance::data::DataConfig;
use keydance::models::transition::DanceClip;
use keydance::motion::features::VELOCITY_FACTORS;
use keydance::motion::{Clip, bvh};
use keydance::synthesis::SequenceRequest;
use ndarray::s;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::martial_data::martial_folder;
use crate::trained_run::{TrainedRun, keydance};
use crate::viewer_page::page_data;

static FIXTURE: LazyLock<TrainedRun> = LazyLock::new(TrainedRun::new);

/// The fixture's clips by name.
static CLIPS: LazyLock<Vec<PathBuf>> = LazyLock::new(|| {
    let entries = fs::read_dir(FIXTURE.path("data")).unwrap();
    let mut clips: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    clips.sort();
    clips
});

/// `keydance generate` with a model of the fixture.
fn generate(model: &str) -> Command {
    let mut command = keydance("generate");
    command.arg(FIXTURE.path(model));
    command
}

/// The same with frames 20, 80 and 140 of the first clip as keyframes.
fn three_keyframes(model: &str) -> Command {
    let mut command = generate(model);
    command.arg("--motion").arg(&CLIPS[0]);
    command.args(["--keyframes", "20,80,140"]);
    command
}

fn read(path: &Path) -> Clip {
    bvh::read(path).unwrap().to_clip()
}

fn world(clip: &Clip) -> Vec<Vec<DVec3>> {
    clip.skeleton.world_positions(&clip.poses)
}

fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f64::max)
}

/// A CSV file with these columns and a row of `row` for each of `frames` frames.
fn table(path: &Path, columns: &str, frames: usize, row: impl Fn(usize) -> String) {
    let rows: String = (0..frames)
        .map(|frame| format!("{frame},{}\n", row(frame)))
        .collect();
    fs::write(path, format!("frame,{columns}\n{rows}")).unwrap();
}

#[test]
fn a_model_that_knows_nothing_still_passes_through_the_keyframes_in_the_files_own_hierarchy() {
    let out = TempDir::new().unwrap();
    let (file, json) = (out.path().join("dance.bvh"), out.path().join("dance.json"));
    three_keyframes("run")
        .arg("--foot-cleanup")
        .arg("--out")
        .arg(&file)
        .arg("--json")
        .arg(&json)
        .assert()
        .success()
        .stdout(
            contains("121 frames at 30.0000 a second")
                .and(contains("keyframe at frame 60: the model missed it by")),
        );
    let (result, source) = (bvh::read(&file).unwrap(), bvh::read(&CLIPS[0]).unwrap());
    assert_eq!(result.skeleton(), source.skeleton());
    assert_eq!(result.channels(), source.channels());
    assert_eq!(result.frame_time(), source.frame_time());
    let (found, recorded) = (world(&result.to_clip()), world(&source.to_clip()));
    assert_eq!(found.len(), 121);
    for (time, frame) in [(0, 20), (60, 80), (120, 140)] {
        let off = farthest(&found[time], &recorded[frame]);
        assert!(off < 0.01, "frame {time}: {off} cm");
    }
    let summary: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    assert_eq!(summary["units"]["missed"], "cm");
    let missed = &summary["keyframes"][1]["missed"];
    assert!(missed["mean"].as_f64().unwrap() > 1.0);
    assert!(summary["rotation_fit_error"]["max"].as_f64().unwrap() > 0.0);
    assert_eq!(summary["keyframes"][0]["missed"], Value::Null);
}

#[test]
fn blanks_in_a_list_are_no_part_of_it_and_a_keyframe_that_is_met_is_no_miss() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("dance.bvh");
    let with = |lists: &[&str]| {
        let mut command = generate("interpolation.toml");
        command
            .arg("--motion")
            .arg(&CLIPS[0])
            .arg("--out")
            .arg(&file);
        command.args(lists).assert()
    };
    with(&["--keyframes", "20, 80 , 140", "--length", " 60, 60"])
        .success()
        .stdout(
            contains("121 frames at")
                .and(contains("keyframe at frame 60: the model met it\n"))
                .and(contains("missed").not()),
        );
    for (lists, words) in [
        (["--keyframes", "20,,80"], "whole numbers from 0"),
        (["--keyframes", "20,-80"], "whole numbers from 0"),
    ] {
        with(&lists).failure().stderr(contains(words));
    }
}

/// The velocity factors and root positions that a viewer's page says were asked for, a row a frame.
fn asked(page: &Path) -> (Vec<[f64; 5]>, Vec<[f64; 3]>) {
    let data = page_data(&fs::read_to_string(page).unwrap());
    let factors = serde_json::from_value(data["asked"].clone());
    let trajectory = serde_json::from_value(data["trajectory"].clone());
    (factors.unwrap(), trajectory.unwrap())
}

/// The share of a path's way on the floor that is gone at each of its points.
fn shares_of_way(path: &[[f64; 3]]) -> Vec<f64> {
    let mut gone = vec![0.0];
    for pair in path.windows(2) {
        let step = (pair[1][0] - pair[0][0]).hypot(pair[1][2] - pair[0][2]);
        gone.push(gone[gone.len() - 1] + step);
    }
    let whole = gone[gone.len() - 1];
    gone.iter().map(|way| way / whole).collect()
}

#[test]
fn a_motion_of_the_same_weights_is_nearer_to_the_speeds_asked_for_where_it_is_refined() {
    let out = TempDir::new().unwrap();
    let factors = |clip: Clip| {
        let clip = DanceClip::new(clip, None, &DataConfig::default()).unwrap();
        clip.features.slice(s![.., VELOCITY_FACTORS]).to_owned()
    };
    let asked = factors(read(&CLIPS[0]));
    let missed = |refined: bool| {
        let file = out.path().join(format!("{refined}.bvh"));
        let option = format!("model.velocity_refinement={refined}");
        let mut command = three_keyframes("run");
        command.args(["--set", &option, "--out"]).arg(&file);
        command.assert().success();
        let missed = factors(read(&file)) - asked.slice(s![20..141, ..]);
        missed.mapv(f64::abs).mean().unwrap()
    };
    let [plain, refined] = [false, true].map(missed);
    assert!(refined < 0.8 * plain, "{refined} {plain}");
    three_keyframes("run")
        .args(["--set", "model.heads=1", "--out"])
        .arg(out.path().join("other.bvh"))
        .assert()
        .failure()
        .stderr(
            contains("its size")
                .and(contains("cannot be changed"))
                .and(contains("model.heads")),
        );
}

#[test]
fn controls_combine() {
    let out = TempDir::new().unwrap();
    let at = |name: &str| out.path().join(name);
    let root = at("root.csv");
    // 121 frames along x, 1 cm each.
    table(&root, "X, y ,z,comment", 130, |frame| {
        format!("{frame},95,0,here")
    });
    let factors = at("factors.csv");
    table(
        &factors,
        "left_arm,right_arm,right_leg,left_leg,trunk",
        121,
        |_| "1,2,3,4,5".into(),
    );
    three_keyframes("interpolation.toml")
        .arg("--trajectory")
        .arg(&root)
        .arg("--velocity-csv")
        .arg(&factors)
        .args([
            "--velocity",
            "0.5,trunk=1",
            "--turn",
            "-90",
            "--scale",
            "2",
            "--raise",
            "-10",
        ])
        .arg("--out")
        .arg(at("a.bvh"))
        .arg("--viewer")
        .arg(at("a.html"))
        .assert()
        .success()
        .stderr(contains("misses the root of the keyframe at frame 0"));
    let dance = world(&read(&at("a.bvh")));
    for (frame, joints) in dance.iter().enumerate() {
        // Turned clockwise from above, x becomes z.
        let expected = DVec3::new(0.0, joints[0].y, 2.0 * frame as f64);
        assert!(
            joints[0].distance(expected) < 1e-3,
            "frame {frame}: {}",
            joints[0]
        );
    }
    assert!((dance[60][0].y - 95.0).abs() < 1e-3 && (dance[30][0].y - 85.0).abs() < 1e-3);
    // Trunk, left leg, right leg, right arm, left arm, whatever the order of the file's columns.
    assert_eq!(asked(&at("a.html")).0, [[5.0, 2.0, 1.5, 1.0, 0.5]; 121]);
    three_keyframes("interpolation.toml")
        .args([
            "--trajectory-through",
            "-50,0; 0,50; 50,0",
            "--timing",
            "clip",
            "--length",
            "100,40",
        ])
        .arg("--velocity-from")
        .arg(format!("{}:30", CLIPS[1].display()))
        .arg("--out")
        .arg(at("b.bvh"))
        .arg("--viewer")
        .arg(at("b.html"))
        .assert()
        .success();
    let dance = world(&read(&at("b.bvh")));
    assert_eq!(dance.len(), 141);
    assert!(dance[0][0].distance(DVec3::new(-50.0, dance[0][0].y, 0.0)) < 1e-3);
    assert!(dance[140][0].distance(DVec3::new(50.0, dance[140][0].y, 0.0)) < 1e-3);
    let features = |clip: usize| {
        let clip = read(&CLIPS[clip]);
        DanceClip::new(clip, None, &DataConfig::default()).unwrap()
    };
    let other = features(1).features;
    let wanted = other.slice(s![30..171, VELOCITY_FACTORS]);
    let (factors, trajectory) = asked(&at("b.html"));
    assert_eq!(factors.len(), 141);
    for (asked, wanted) in factors.iter().flatten().zip(wanted) {
        assert!((asked - wanted).abs() < 0.0051, "{asked} {wanted}");
    }
    // The curve is gone at the speeds of the clip, stretched to the same times; at one speed it
    // would be elsewhere.
    let clip = SequenceRequest::from_clip(&features(0), &[20, 80, 140]).unwrap();
    let clip = clip.at_times(&[0, 100, 140]).unwrap().root_trajectory;
    let clip: Vec<[f64; 3]> = clip
        .rows()
        .into_iter()
        .map(|place| [place[0], place[1], place[2]])
        .collect();
    let (recorded, found) = (shares_of_way(&clip), shares_of_way(&trajectory));
    let off_by = |other: &dyn Fn(usize) -> f64| {
        let apart = (0..=140).map(|frame| (found[frame] - other(frame)).abs());
        apart.fold(0.0, f64::max)
    };
    assert!(off_by(&|frame| recorded[frame]) < 0.005);
    assert!(off_by(&|frame| frame as f64 / 140.0) > 0.05);
}

#[test]
fn keyframes_of_several_files_meet_in_one_dance() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("dance.bvh");
    let keyframe = |clip: usize, frame: usize, time: usize| {
        format!("{}:{frame}@{time}", CLIPS[clip].display())
    };
    generate("run")
        .args([
            "--keyframe",
            &keyframe(1, 30, 50),
            "--keyframe",
            &keyframe(0, 70, 0),
        ])
        .args(["--keyframe", &keyframe(2, 0, 120)])
        .arg("--out")
        .arg(&file)
        .assert()
        .success();
    let dance = world(&read(&file));
    assert_eq!(dance.len(), 121);
    for (clip, frame, time) in [(0, 70, 0), (1, 30, 50), (2, 0, 120)] {
        let recorded = world(&read(&CLIPS[clip]));
        let off = farthest(&dance[time], &recorded[frame]);
        assert!(off < 0.01, "frame {time}: {off} cm");
    }
}

#[test]
fn what_was_generated_can_be_generated_from() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("dance.bvh");
    let again = out.path().join("again.bvh");
    three_keyframes("run")
        .arg("--out")
        .arg(&file)
        .assert()
        .success();
    generate("run")
        .arg("--motion")
        .arg(&file)
        .args(["--keyframes", "0,30"])
        .arg("--out")
        .arg(&again)
        .assert()
        .success();
    assert_eq!(read(&again).poses.len(), 31);
}

#[test]
fn a_clip_on_another_skeleton_is_counted_at_thirty_frames_a_second_and_danced_on_its_own_at_its_own_rate()
 {
    let Some(folder) = martial_folder() else {
        return;
    };
    let out = TempDir::new().unwrap();
    let file = out.path().join("kick.bvh");
    let mapping = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/mappings/cmu.toml");
    generate("interpolation.toml")
        .arg("--motion")
        .arg(folder.join("03.bvh"))
        .arg("--mapping")
        .arg(&mapping)
        .args(["--keyframes", "30,90,120", "--foot-cleanup"])
        .arg("--out")
        .arg(&file)
        .assert()
        .success();
    let recorded = read(&folder.join("03.bvh"));
    let (dance, recorded) = (world(&read(&file)), world(&recorded));
    assert_eq!(dance.len(), 4 * 90 + 1);
    for (time, frame) in [(0, 30), (60, 90), (90, 120)] {
        let off = farthest(&dance[4 * time], &recorded[4 * frame]);
        assert!(off < 1e-5, "frame {time}: {off} cm");
    }
}

/// Runs the command and expects this in its error, and no file.
fn refused(mut command: Command, message: &str) {
    let out = TempDir::new().unwrap();
    let file = out.path().join("dance.bvh");
    command
        .arg("--out")
        .arg(&file)
        .assert()
        .failure()
        .stderr(contains(message).and(contains("panicked").not()));
    assert!(!file.exists(), "{message}");
}

#[test]
fn keyframes_that_cannot_be_used_are_named() {
    let clip = CLIPS[0].display().to_string();
    let with = |args: &[&str]| {
        let mut command = generate("interpolation.toml");
        command.args(args);
        command
    };
    refused(with(&[]), "no keyframes; give --motion");
    refused(with(&["--motion", &clip]), "--keyframes");
    refused(with(&["--keyframes", "1,2"]), "--motion");
    refused(
        with(&["--motion", &clip, "--keyframes", "10,5"]),
        "frame 5 follows frame 10",
    );
    refused(
        with(&["--motion", &clip, "--keyframes", "10,10"]),
        "frame 10 follows frame 10",
    );
    refused(
        with(&["--motion", &clip, "--keyframes", "10,180"]),
        "has no frame 180: its frames are 0 to 179",
    );
    refused(
        with(&["--motion", &clip, "--keyframes", "10"]),
        "one keyframe only",
    );
    refused(with(&["--motion", &clip, "--keyframes", "10,x"]), "invalid");
    refused(
        with(&["--motion", &clip, "--keyframes", "10,-3"]),
        "invalid",
    );
    refused(
        with(&["--motion", "nowhere.bvh", "--keyframes", "10,20"]),
        "nowhere.bvh cannot be read",
    );
    refused(with(&["--keyframe", "a.bvh"]), "FILE.bvh:FRAME@TIME");
    let at = |frame: usize, time: usize| format!("{clip}:{frame}@{time}");
    refused(with(&["--keyframe", &at(5, 0)]), "one keyframe only");
    refused(
        with(&["--keyframe", &at(5, 3), "--keyframe", &at(9, 8)]),
        "stands at frame 3",
    );
    refused(
        with(&["--keyframe", &at(5, 0), "--keyframe", &at(9, 0)]),
        "two keyframes stand at frame 0",
    );
    refused(
        with(&[
            "--motion",
            &clip,
            "--keyframes",
            "100,150",
            "--keyframe",
            &at(9, 90),
        ]),
        "ends 79 frames after its first keyframe",
    );
    refused(
        with(&[
            "--motion",
            &clip,
            "--keyframes",
            "1,20",
            "--keyframe",
            &at(9, 50),
            "--length",
            "30",
        ]),
        "cannot be used with",
    );
}

#[test]
fn controls_that_cannot_be_used_are_named() {
    let folder = TempDir::new().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let with = |args: &[&str]| {
        let mut command = three_keyframes("interpolation.toml");
        command.args(args);
        command
    };
    let empty = file("empty.csv", "");
    refused(
        with(&["--trajectory", &empty]),
        "empty.csv, line 1: there is no column \"frame\"",
    );
    let short = file("short.csv", "frame,x,y,z\n0,1,2,3\n1,1,2,3\n");
    refused(
        with(&["--trajectory", &short]),
        "has rows for 2 frames; the result has 121",
    );
    let gap = file("gap.csv", "frame,x,y,z\n0,1,2,3\n\n2,1,2,3\n");
    refused(
        with(&["--trajectory", &gap]),
        "gap.csv, line 4: expected frame 1, found frame 2",
    );
    let word = file("word.csv", "frame,x,y,z\n0,1,high,3\n");
    refused(
        with(&["--trajectory", &word]),
        "word.csv, line 2: y is \"high\"",
    );
    let nan = file("nan.csv", "frame,x,y,z\n0,1,NaN,3\n");
    refused(with(&["--trajectory", &nan]), "line 2: y is \"NaN\"");
    let ragged = file("ragged.csv", "frame,x,y,z\n0,1,2,3\n1,2\n");
    refused(with(&["--trajectory", &ragged]), "line: 3");
    let flat = file("flat.csv", "frame,x,z\n0,1,3\n");
    refused(
        with(&["--trajectory", &flat]),
        "there is no column \"y\"; expected the columns frame,x,y,z",
    );
    refused(
        with(&["--trajectory", "nowhere.csv"]),
        "nowhere.csv cannot be read",
    );
    refused(
        with(&["--trajectory", &flat, "--trajectory-through", "0,0;1,1"]),
        "cannot be used with",
    );
    refused(with(&["--trajectory-through", "0,0"]), "two points or more");
    refused(
        with(&["--trajectory-through", "0,0;a,1"]),
        "point 2: \"a\" is no number",
    );
    refused(with(&["--timing", "clip"]), "--trajectory-through");
    refused(with(&["--scale", "0"]), "expected a positive number");
    refused(with(&["--turn", "nan"]), "--turn");
    refused(
        with(&["--turn", "-200000"]),
        "--turn -200000: expected a number between -100000 and 100000",
    );
    refused(with(&["--raise", "inf"]), "--raise");
    refused(
        with(&["--velocity", "head=2"]),
        "\"head\" is no part of the body",
    );
    refused(with(&["--velocity", "-1"]), "--velocity");
    let factors = file(
        "factors.csv",
        "frame,trunk,left_leg,right_leg,right_arm,left_arm\n0,1,1,1,-1,1\n",
    );
    refused(
        with(&["--velocity-csv", &factors, "--length", "1"]),
        "has rows for 1 frame; the result has 3",
    );
    refused(
        with(&["--velocity-csv", &factors, "--velocity-from", "a.bvh"]),
        "cannot be used with",
    );
    let clip = CLIPS[1].display().to_string();
    refused(
        with(&["--velocity-from", &format!("{clip}:100")]),
        "has 180 frames, the result needs velocity factors of 121",
    );
    refused(
        with(&["--velocity-from", &format!("{clip}:18446744073709551615")]),
        "has 180 frames, the result needs velocity factors of 121",
    );
    refused(
        with(&["--velocity-from", "nowhere.bvh:3"]),
        "nowhere.bvh cannot be read",
    );
    refused(with(&["--length", "0"]), "--length");
    refused(with(&["--length", "60000"]), "frame 120000 of the result");
    refused(
        with(&["--length", "108000,108000"]),
        "frame 216000 of the result",
    );
    refused(
        with(&["--length", "10,20,30"]),
        "gives 3 numbers for the 2 transitions",
    );
    let trained = FIXTURE.path("small.toml");
    let mut command = keydance("generate");
    command
        .arg(trained)
        .arg("--motion")
        .arg(&CLIPS[0])
        .args(["--keyframes", "1,20"]);
    refused(command, "keydance train");
}

#[test]
fn a_control_beyond_the_training_data_is_generated_with_a_warning_that_says_by_how_much() {
    let out = TempDir::new().unwrap();
    let manifest: Value =
        serde_json::from_slice(&fs::read(FIXTURE.path("run").join("manifest.json")).unwrap())
            .unwrap();
    let bound = manifest["data_ranges"]["velocity_factors"][3]
        .as_f64()
        .unwrap();
    three_keyframes("run")
        .args(["--velocity", "right_arm=100"])
        .arg("--out")
        .arg(out.path().join("dance.bvh"))
        .assert()
        .success()
        .stderr(
            contains("warning: the velocity factor of right_arm is")
                .and(contains("times the training data's highest"))
                .and(contains(format!("({bound:.1} in 99.9 % of its frames)"))),
        );
}

#[test]
fn a_control_that_the_model_does_not_read_is_named() {
    let out = TempDir::new().unwrap();
    let dance = |model: &str, control: [&str; 2]| {
        let mut command = three_keyframes(model);
        command.args(control);
        command.arg("--force").arg("--out");
        command.arg(out.path().join("dance.bvh"));
        command.assert().success()
    };
    dance("interpolation.toml", ["--velocity", "1.1"])
        .stderr(contains("warning: the model reads no velocity factors"));
    for (model, control) in [("interpolation.toml", "--raise"), ("run", "--velocity")] {
        dance(model, [control, "1.1"]).stderr(contains("the model reads no").not());
    }
}

#[test]
fn the_clips_of_the_choreography_can_be_written_as_files() {
    let out = TempDir::new().unwrap();
    let folder = out.path().join("clips");
    let write = || {
        let mut command = keydance("choreography");
        command
            .args(["--clips", "2", "--frames", "40", "--seed", "3", "--out"])
            .arg(&folder);
        command
    };
    write()
        .assert()
        .success()
        .stdout(contains("choreography_000"));
    write().assert().failure().stderr(contains("--force"));
    write().arg("--force").assert().success();
    let files: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    assert_eq!(files.len(), 2);
    for file in files {
        let clip = read(&file);
        assert_eq!(clip.poses.len(), 40);
        assert!(clip.skeleton.is_dance_skeleton());
    }
    for flag in ["--clips", "--frames"] {
        let mut command = keydance("choreography");
        command.args([flag, "0", "--out"]).arg(&folder);
        command.assert().failure().stderr(contains(flag));
    }
}

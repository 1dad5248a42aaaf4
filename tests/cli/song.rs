//! Dances to a song through the binary: generated dances with their music, a model trained on them,
//! whole songs with key poses at seconds of them.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use keydance::motion::bvh::{self, Bvh};
use keydance::motion::{Clip, Pose};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::browser::{self, Loaded};
use crate::rigs::from_another_rest_pose;
use crate::trained_run::keydance;
use crate::viewer_page::page_data;

const CONFIG: &str = "name = 'pu'\n[data]\nsplit = { share = 0.8 }\nmusic = true\n\
    [model]\nkind = 'pu2022'\nwidth = 8\nheads = 2\nmotion_layers = 1\nmusic_layers = 1\n\
    cross_layers = 1\nfeed_forward = 8\n\
    [window]\nseed = 20\nlength = 60\n\
    [schedule]\nsteps = 4\nbatch_size = 2\nkey_poses = 2\n";

/// Five dances of 240 frames with music in `data`, and a run.
pub struct Fixture {
    folder: TempDir,
}

pub static FIXTURE: LazyLock<Fixture> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let fixture = Fixture { folder };
    let mut command = fixture.command("choreography");
    command.args(["--music", "--clips", "5", "--frames", "240", "--seed", "4"]);
    command.arg("--out").arg(fixture.path("data"));
    command.assert().success();
    fs::write(fixture.path("pu.toml"), CONFIG).unwrap();
    fixture.train("run").assert().success();
    fixture
});

impl Fixture {
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// With a cache of its own.
    pub fn command(&self, name: &str) -> Command {
        let mut command = keydance(name);
        command.env("XDG_CACHE_HOME", self.path("cache"));
        command
    }

    fn train(&self, run: &str) -> Command {
        let mut command = self.command("train");
        command.arg(self.path("pu.toml"));
        command.arg("--data").arg(self.path("data"));
        command.arg("--out").arg(self.path(run));
        command
    }

    /// The `index`-th file of the data with this ending.
    pub fn file(&self, index: usize, ending: &str) -> PathBuf {
        let entries = fs::read_dir(self.path("data")).unwrap();
        let paths = entries.map(|entry| entry.unwrap().path());
        let mut files: Vec<PathBuf> = paths
            .filter(|path| path.extension().is_some_and(|it| it == ending))
            .collect();
        files.sort();
        files[index].clone()
    }

    /// `keydance generate` to the first song, from the start of its dance.
    fn generate(&self, out: &Path) -> Command {
        let mut command = self.command("generate");
        command.arg(self.path("run"));
        command.arg("--music").arg(self.file(0, "wav"));
        command.arg("--seed-motion");
        command.arg(format!("{}:0", self.file(0, "bvh").display()));
        command.arg("--out").arg(out);
        command
    }

    fn key(&self, frame_at: &str) -> String {
        format!("{}:{frame_at}", self.file(1, "bvh").display())
    }
}

#[test]
fn a_whole_song_is_danced_from_the_seed_with_key_poses_at_its_seconds() {
    let folder = TempDir::new().unwrap();
    let (out, json) = (
        folder.path().join("dance.bvh"),
        folder.path().join("dance.json"),
    );
    let mut command = FIXTURE.generate(&out);
    command.arg("--keyframe").arg(FIXTURE.key("75@4.5s"));
    command.arg("--keyframe").arg(FIXTURE.key("30@100"));
    command.arg("--keyframe").arg(FIXTURE.key("10@22"));
    command.arg("--json").arg(&json);
    let output = command.assert().success();
    let output = output.stdout(contains("key pose at frame 135 (4.50 s)"));
    output.stderr(contains("the key pose at frame 22").and(contains("frame 25 or later")));
    let dance = bvh::read(&out).unwrap().to_clip();
    let recorded = bvh::read(&FIXTURE.file(0, "bvh")).unwrap().to_clip();
    assert_eq!(dance.poses.len(), 240);
    for (pose, seed) in dance.poses.iter().zip(&recorded.poses[..20]) {
        assert!(pose.translations[0].distance(seed.translations[0]) < 1e-4);
    }
    let summary: Value = serde_json::from_slice(&fs::read(&json).unwrap()).unwrap();
    let keys = summary["key_poses"].as_array().unwrap().iter();
    let frames: Vec<u64> = keys.map(|key| key["frame"].as_u64().unwrap()).collect();
    assert_eq!(frames, [22, 100, 135]);
    assert_eq!(summary["units"]["distance"], "cm");
    assert_eq!(summary["seed_is_held"], false);
}

#[test]
fn one_pose_may_be_held_and_the_dance_may_end_before_the_song() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let mut command = FIXTURE.command("generate");
    command.arg(FIXTURE.path("run"));
    command.arg("--music").arg(FIXTURE.file(2, "wav"));
    command.arg("--seed-pose").arg(FIXTURE.key("50"));
    command.args(["--until", "3.5s"]).arg("--out").arg(&out);
    command.args(["--contacts", "left:0-10"]);
    let output = command.assert().success();
    let output = output.stdout(contains("seed: one pose held for 20 frames"));
    output.stderr(contains("does not read contacts: left out"));
    let dance = bvh::read(&out).unwrap().to_clip();
    assert_eq!(dance.poses.len(), 105);
    assert_eq!(dance.poses[0].rotations, dance.poses[19].rotations);
}

#[test]
fn key_poses_that_a_model_does_not_read_are_said_to_be_left_out() {
    let folder = TempDir::new().unwrap();
    for (config, reads) in [("hold", false), ("interpolation", true)] {
        let mut command = FIXTURE.command("generate");
        command.arg(format!("experiments/pu2022/{config}.toml"));
        command.arg("--music").arg(FIXTURE.file(0, "wav"));
        command.arg("--seed-pose").arg(FIXTURE.key("50"));
        command.arg("--keyframe").arg(FIXTURE.key("75@4s"));
        command
            .arg("--out")
            .arg(folder.path().join(format!("{config}.bvh")));
        let says = contains("does not read key poses: left out");
        let output = command.assert().success();
        match reads {
            true => output.stderr(says.not()),
            false => output.stderr(says),
        };
    }
}

#[test]
fn what_does_not_fit_the_song_is_said_and_nothing_is_written() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let cases: [(&[&str], &str); 6] = [
        (&["75@8s"], "lies beyond the dance, whose last frame is 239"),
        (&["75@5"], "lies in the seed, whose last frame is 19"),
        (&["75@2s", "80@60"], "two key poses stand at frame 60"),
        (&["75@-1s"], "is not from 0 to 86400 seconds"),
        (
            &["75@soon"],
            "expected a frame such as 375, or seconds such as 12.5s",
        ),
        (&["9999@60"], "has no frame 9999"),
    ];
    for (keys, message) in cases {
        let mut command = FIXTURE.generate(&out);
        for key in keys {
            command.arg("--keyframe").arg(FIXTURE.key(key));
        }
        command.assert().failure().stderr(contains(message));
        assert!(!out.exists(), "{message}");
    }
    let mut command = FIXTURE.generate(&out);
    command.args(["--until", "10"]);
    let output = command.assert().failure();
    output.stderr(contains("is no longer than the seed, 20 frames"));
    assert!(!out.exists());
    let mut command = FIXTURE.generate(&out);
    command.args(["--until", "-5s"]);
    let output = command.assert().failure().code(2);
    output.stderr(contains("--until").and(contains("-5s is not from 0 to 86400 seconds")));
    for seed in ["--seed-motion", "--seed-pose"] {
        let mut command = FIXTURE.command("generate");
        command.arg(FIXTURE.path("run")).arg("--out").arg(&out);
        command.arg("--music").arg(FIXTURE.file(0, "wav"));
        command.arg(seed).arg(FIXTURE.key("soon"));
        let output = command.assert().failure().code(2);
        output.stderr(contains("expected FILE.bvh or FILE.bvh:FRAME"));
    }
    let mut command = FIXTURE.command("generate");
    command.arg(FIXTURE.path("run")).arg("--out").arg(&out);
    command
        .assert()
        .failure()
        .stderr(contains("give --music SONG"));
}

/// Mean distance of the joints of two frames, cm.
fn apart(frames: [(&Clip, usize); 2]) -> f64 {
    let [one, other] =
        frames.map(|(clip, frame)| clip.poses[frame].world_positions(&clip.skeleton));
    let distances = one.iter().zip(&other).map(|(a, b)| a.distance(*b));
    distances.sum::<f64>() / one.len() as f64
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn a_seed_and_key_poses_from_another_rest_pose_give_a_dance_on_that_rig() {
    let folder = TempDir::new().unwrap();
    let document = bvh::read(&FIXTURE.file(1, "bvh")).unwrap();
    let clip = document.to_clip();
    let other = folder.path().join("other.bvh");
    let turned = from_another_rest_pose(&clip);
    let turned = Bvh::from_clip(&turned, document.channels().to_vec()).unwrap();
    bvh::write(&other, &turned).unwrap();
    let dance = |file: &Path, name: &str| {
        let out = folder.path().join(name);
        let mut command = FIXTURE.command("generate");
        command.arg("--out").arg(&out);
        command.arg("--music").arg(FIXTURE.file(0, "wav"));
        command
            .arg("--seed-motion")
            .arg(format!("{}:40", file.display()));
        command
            .arg("--keyframe")
            .arg(format!("{}:180@140", file.display()));
        command.arg("--json").arg(out.with_extension("json"));
        command.assert().success();
        bvh::read(&out).unwrap()
    };
    let own = dance(&FIXTURE.file(1, "bvh"), "own.bvh");
    let made = dance(&other, "made.bvh");
    let written = bvh::read(&other).unwrap();
    assert_eq!(made.skeleton(), written.skeleton());
    assert_eq!(made.channels(), written.channels());
    let (own, made) = (own.to_clip(), made.to_clip());
    assert_eq!(own.poses.len(), made.poses.len());
    for frame in 0..60 {
        let apart = apart([(&own, frame), (&made, frame)]);
        assert!(apart < 1e-6, "frame {frame}: {apart} cm");
    }
    let key = &json(&folder.path().join("made.json"))["key_poses"][0];
    assert!(key["distance"].as_f64().unwrap() < 12.0, "{key}");
}

#[test]
fn a_dance_of_a_small_body_stands_on_the_floor_of_its_seed() {
    let folder = TempDir::new().unwrap();
    let document = bvh::read(&FIXTURE.file(1, "bvh")).unwrap();
    let mut clip = document.to_clip();
    clip.skeleton
        .joints
        .iter_mut()
        .for_each(|joint| joint.offset *= 0.7);
    let places = clip
        .poses
        .iter_mut()
        .flat_map(|pose| &mut pose.translations);
    places.for_each(|place| *place *= 0.7);
    let [small, out] = ["small.bvh", "dance.bvh"].map(|name| folder.path().join(name));
    let written = Bvh::from_clip(&clip, document.channels().to_vec()).unwrap();
    bvh::write(&small, &written).unwrap();
    let mut command = FIXTURE.command("generate");
    command
        .arg("--music")
        .arg(FIXTURE.file(0, "wav"))
        .arg("--out")
        .arg(&out);
    command
        .arg("--seed-motion")
        .arg(format!("{}:40", small.display()));
    command.assert().success();
    let dance = bvh::read(&out).unwrap().to_clip();
    let floor = |poses: &[Pose]| {
        let lowest = poses.iter().map(|pose| {
            let places = pose.world_positions(&dance.skeleton).into_iter();
            places.map(|place| place.y).fold(f64::INFINITY, f64::min)
        });
        let mut heights: Vec<f64> = lowest.collect();
        heights.sort_by(f64::total_cmp);
        heights[heights.len() / 10]
    };
    let [seed, after] = [floor(&dance.poses[..60]), floor(&dance.poses[80..])];
    assert!((seed - after).abs() < 3.0, "{seed} {after} cm");
}

#[test]
fn a_dance_does_not_jump_where_the_model_does() {
    let folder = TempDir::new().unwrap();
    let [out, summary] = ["dance.bvh", "dance.json"].map(|name| folder.path().join(name));
    let mut command = FIXTURE.generate(&out);
    command.arg("--keyframe").arg(FIXTURE.key("75@95"));
    command.arg("--keyframe").arg(FIXTURE.key("75@140"));
    let output = command.arg("--json").arg(&summary).assert().success();
    output.stdout(contains("seams: 7, at the widest of which joints jump by"));
    let dance = bvh::read(&out).unwrap().to_clip();
    let summary = json(&summary);
    let seams = summary["seams"].as_array().unwrap();
    let frames: Vec<u64> = seams
        .iter()
        .map(|it| it["frame"].as_u64().unwrap())
        .collect();
    // A window ends with its last key pose, or so that the next has 20 frames to its first.
    assert_eq!(frames, [20, 60, 96, 120, 141, 181, 221]);
    let recorded = bvh::read(&FIXTURE.file(0, "bvh")).unwrap().to_clip();
    let [speed, step] = [&recorded, &dance].map(|clip| apart([(clip, 19), (clip, 20)]));
    let jump = seams[0]["jump"].as_f64().unwrap();
    assert!(
        step < 2.0 * speed + 0.1 * jump && 5.0 * step < jump,
        "{speed} {jump} {step}"
    );
}

#[test]
fn a_dance_without_its_music_and_music_shorter_than_its_dance_are_named() {
    let folder = TempDir::new().unwrap();
    let data = folder.path().join("data");
    fs::create_dir(&data).unwrap();
    for index in 0..5 {
        for ending in ["bvh", "wav"] {
            let file = FIXTURE.file(index, ending);
            fs::copy(&file, data.join(file.file_name().unwrap())).unwrap();
        }
    }
    let train = || {
        let mut command = FIXTURE.command("train");
        command
            .arg(FIXTURE.path("pu.toml"))
            .arg("--data")
            .arg(&data);
        command.arg("--out").arg(folder.path().join("never"));
        command.assert().failure()
    };
    let song = data.join(FIXTURE.file(3, "wav").file_name().unwrap());
    let other = data.join("other.wav");
    fs::rename(&song, &other).unwrap();
    train().stderr(contains("has no music: data.music = true asks"));
    let bytes = fs::read(&other).unwrap();
    // 200 of 240 frames, the header as it was: what is there is heard.
    fs::write(&song, &bytes[..44 + 200 * 735 * 2]).unwrap();
    train().stderr(contains("240 frames and its music"));
    fs::write(&song, &bytes).unwrap();
    fs::copy(&other, song.with_extension("ogg")).unwrap();
    train().stderr(contains("are music of one name; keep one of them"));
}

#[test]
fn a_recorded_dance_is_regenerated_from_random_key_poses_of_it() {
    let folder = TempDir::new().unwrap();
    let regenerate = |out: &Path, seed: &str| {
        let mut command = FIXTURE.command("regenerate");
        command.arg(FIXTURE.path("run")).arg(FIXTURE.file(0, "bvh"));
        command
            .args(["--count", "2", "--seed", seed])
            .arg("--out")
            .arg(out);
        command
    };
    let [first, again, other] = ["first", "again", "other"].map(|name| folder.path().join(name));
    let output = regenerate(&first, "1").assert().success();
    output.stdout(contains("key pose"));
    regenerate(&again, "1").assert().success();
    regenerate(&other, "2").assert().success();
    let stem = FIXTURE
        .file(0, "bvh")
        .file_stem()
        .unwrap()
        .to_string_lossy()
        .into_owned();
    let dance = |folder: &Path, number: usize| {
        fs::read(folder.join(format!("{stem}_{number:03}.bvh"))).unwrap()
    };
    assert_eq!(dance(&first, 1), dance(&again, 1));
    assert_ne!(dance(&first, 1), dance(&first, 2));
    assert_ne!(dance(&first, 1), dance(&other, 1));
    regenerate(&first, "1")
        .assert()
        .failure()
        .stderr(contains("--force"));
}

#[test]
fn a_dance_that_is_too_short_to_be_regenerated_is_named_with_both_lengths() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let mut command = FIXTURE.command("choreography");
    command.args(["--clips", "1", "--frames", "15", "--out"]);
    command.arg(path("short")).assert().success();
    let clip = fs::read_dir(path("short")).unwrap().next().unwrap();
    let mut command = FIXTURE.command("regenerate");
    command.arg(FIXTURE.path("run")).arg(clip.unwrap().path());
    command.arg("--music").arg(FIXTURE.file(0, "wav"));
    command.arg("--out").arg(path("out"));
    let output = command.assert().failure();
    output.stderr(contains("has 15 frames").and(contains("the first 20 frames of a dance")));
    assert!(!path("out").exists());
}

#[test]
fn a_batch_has_the_windows_of_the_model_and_other_wishes_are_refused() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("batch.safetensors");
    let export = |more: &[&str]| {
        let mut command = FIXTURE.command("export-batch");
        command.arg(FIXTURE.path("run"));
        command.arg("--data").arg(FIXTURE.path("data"));
        command.args(["--windows", "2"]).args(more);
        command.arg("--out").arg(&out).assert()
    };
    let refused = export(&["--frames", "30"]).failure();
    refused.stderr(contains(
        "--frames 30: the model has 60 (window.length) and no other number",
    ));
    let refused = export(&["--ground-truth"]).failure();
    refused.stderr(contains("--ground-truth: the model is never fed"));
    assert!(!out.exists());
    export(&["--frames", "60"]).success();
}

#[test]
fn the_viewer_plays_the_song_where_it_is_or_holds_it_where_asked() {
    let folder = TempDir::new().unwrap();
    let page = |name: &str, more: &[&str]| {
        let (out, page) = (
            folder.path().join(format!("{name}.bvh")),
            folder.path().join(format!("{name}.html")),
        );
        let mut command = FIXTURE.generate(&out);
        command.arg("--keyframe").arg(FIXTURE.key("75@4s"));
        command.arg("--viewer").arg(&page).args(more);
        command.assert().success();
        page_data(&fs::read_to_string(page).unwrap())
    };
    let beside = page("beside", &[]);
    let source = beside["music"]["source"].as_str().unwrap();
    let song = FIXTURE.file(0, "wav");
    assert!(
        source.ends_with(song.file_name().unwrap().to_str().unwrap()),
        "{source}"
    );
    assert!(!source.contains(':'), "{source} is not relative");
    let beats = beside["music"]["beats"].as_array().unwrap();
    assert!(beats.len() > 4 && beats.iter().all(|beat| beat.as_u64().unwrap() < 240));
    assert_eq!(beside["keyframes"][0]["frame"], 120);

    let held = page("held", &["--embed-music"]);
    let source = held["music"]["source"].as_str().unwrap();
    assert!(source.starts_with("data:audio/wav;base64,"));
    let bytes = fs::metadata(&song).unwrap().len();
    assert!(source.len() as u64 > bytes);
    let Some(browser) = browser::browser() else {
        return;
    };
    let file = folder.path().join("held.html");
    let loaded = browser::load(&browser, &file, "#frame=120", Loaded::has_drawn);
    assert_eq!(loaded.attribute("data-error"), None, "{}", loaded.log);
    assert_eq!(
        loaded.attribute("data-music"),
        None,
        "the song cannot be played"
    );
    assert!(loaded.console().is_empty(), "{:?}", loaded.console());
}

/// The row `retrieval` on the fixture's split.
const RETRIEVAL: &str = "name = 'retrieval'\n[model]\nkind = 'key_pose_retrieval'\n\
    [data]\nsplit = { share = 0.8 }\nmusic = true\n";

#[test]
fn retrieval_finds_the_training_clips_again_and_never_looks_motion_up_in_the_test_clips() {
    let folder = TempDir::new().unwrap();
    let rows = folder.path().join("rows");
    fs::create_dir(&rows).unwrap();
    let config = rows.join("retrieval.toml");
    fs::write(&config, RETRIEVAL).unwrap();
    let error = |file: &Path| {
        let scores: Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
        let scores = &scores["music_dance"];
        assert!(scores["key_pose_error"]["all"].as_f64().unwrap() < 1e-6);
        scores["position_error"]["all"].as_f64().unwrap()
    };
    let [train, test] = ["train", "test"].map(|clips| {
        let json = folder.path().join(clips);
        let mut command = FIXTURE.command("evaluate");
        command.arg(&config).arg("--data").arg(FIXTURE.path("data"));
        command.args(["--clips", clips]).arg("--json").arg(&json);
        command.assert().success();
        error(&json)
    });
    assert!(train < 1e-6 && test > 1.0, "{train} {test}");
    let out = folder.path().join("out");
    let mut command = FIXTURE.command("reproduce");
    command.arg(&rows).arg("--data").arg(FIXTURE.path("data"));
    command.arg("--runs").arg(folder.path().join("runs"));
    command.arg("--out").arg(&out).assert().success();
    assert_eq!(error(&out.join("retrieval/evaluation.json")), test);
}

#[test]
fn retrieval_dances_to_a_song_by_the_clips_that_it_is_given() {
    let folder = TempDir::new().unwrap();
    let (config, out) = (
        folder.path().join("retrieval.toml"),
        folder.path().join("dance.bvh"),
    );
    fs::write(&config, RETRIEVAL).unwrap();
    let generate = || {
        let mut command = FIXTURE.command("generate");
        command
            .arg(&config)
            .arg("--music")
            .arg(FIXTURE.file(0, "wav"));
        command
            .arg("--seed-motion")
            .arg(format!("{}:0", FIXTURE.file(0, "bvh").display()));
        command
            .arg("--keyframe")
            .arg(FIXTURE.key("75@4s"))
            .arg("--out")
            .arg(&out);
        command
    };
    let without = generate().assert().failure();
    without.stderr(contains("give their folder with --data"));
    assert!(!out.exists());
    let mut command = generate();
    command.arg("--data").arg(FIXTURE.path("data"));
    let output = command.assert().success();
    output.stdout(contains(
        "key pose at frame 120 (4.00 s): joints 0.0 cm from it",
    ));
}

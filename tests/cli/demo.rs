//! `keydance demo --reduced` through the binary: every result is written, and it says whether the
//! goal is reached.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use keydance::evaluation::{ProtocolScores, ScoreRow, Scores};
use keydance::motion::bvh;
use keydance::report::demo::pan2021::Comparison;
use keydance::report::demo::pu2022::Goal;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

fn demo(out: &Path) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.args(["demo", "--reduced", "--out"]).arg(out);
    command
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_reduced_demo_ends_ahead_of_what_needs_no_training_and_writes_every_result() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    demo(&out).assert().success().stdout(
        contains("LRP (cm)")
            .and(contains("AVF"))
            .and(contains("ART"))
            .and(contains("transition.bvh"))
            .and(contains("N = 150: model")),
    );

    let lrp = |file: &str, length: &str| {
        json(&out.join(file))["equations"]["lrp"][length]
            .as_f64()
            .unwrap()
    };
    for length in ["100", "150"] {
        let model = lrp("evaluation.json", length);
        for other in ["interpolation.json", "untrained.json"] {
            let other_lrp = lrp(other, length);
            assert!(
                model < other_lrp,
                "N = {length}: {model}, {other_lrp} of {other}"
            );
        }
    }
    let tables = fs::read_to_string(out.join("tables.md")).unwrap();
    for words in [
        "## LRP by `equations`",
        "## ART by `equations`",
        "generated clips",
        &format!("{:.2}", lrp("evaluation.json", "150")),
        &format!("{:.2}", lrp("interpolation.json", "avg")),
    ] {
        assert!(tables.contains(words), "{words}: {tables}");
    }
    for figure in ["loss_curve.svg", "motion.svg"] {
        let text = fs::read_to_string(out.join(figure)).unwrap();
        roxmltree::Document::parse(&text).unwrap();
    }
    let page = fs::read_to_string(out.join("viewer.html")).unwrap();
    assert!(page.contains("Small whole model") && page.len() < 1_000_000);
    let motion = bvh::read(&out.join("transition.bvh")).unwrap().to_clip();
    assert_eq!(motion.poses.len(), 101);
    assert!(motion.skeleton.is_dance_skeleton());
    let manifest = json(&out.join("manifest.json"));
    assert_eq!(manifest["state"], "finished");
    assert_eq!(manifest["steps_done"], manifest["steps"]);
}

#[test]
fn a_demo_takes_the_place_of_an_earlier_one_whether_ahead_or_behind() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    // Hardly trained.
    let digests = ["0.004", "0.002"].map(|fraction| {
        let ended = demo(&out).args(["--fraction", fraction]).output().unwrap();
        assert!([Some(0), Some(4)].contains(&ended.status.code()));
        let manifest = json(&out.join("manifest.json"));
        assert_eq!(manifest["state"], "finished");
        manifest["weights_digest"].clone()
    });
    assert_ne!(digests[0], digests[1]);
}

#[test]
fn another_run_is_not_overwritten_and_a_wrong_fraction_is_named() {
    let folder = TempDir::new().unwrap();
    let config = folder.path().join("config.toml");
    fs::write(&config, "name = 'mine'").unwrap();
    demo(folder.path())
        .assert()
        .failure()
        .stderr(contains("holds a run already"));
    assert_eq!(fs::read_to_string(config).unwrap(), "name = 'mine'");
    demo(&folder.path().join("new"))
        .args(["--fraction", "1.5"])
        .assert()
        .failure()
        .stderr(contains("--fraction").and(contains("1.5")));
    assert!(!folder.path().join("new").exists());
}

fn scores(lrp: [f64; 2]) -> ProtocolScores {
    let row = ScoreRow::new([100, 150].into_iter().zip(lrp));
    let scores = Scores::new([("lrp", row)], [100, 150].map(|length| (length, 1)));
    ProtocolScores::new([("equations", scores)])
}

#[test]
fn ahead_is_ahead_at_every_long_transition() {
    let ahead = |model: [f64; 2]| {
        Comparison {
            interpolation: scores([70.0, 80.0]),
            untrained: scores([75.0, 78.0]),
            model: scores(model),
        }
        .is_ahead()
    };
    assert!(ahead([69.9, 77.9]));
    assert!(!ahead([69.9, 78.0]));
    assert!(!ahead([70.1, 10.0]));
    assert!(!ahead([f64::NAN, 10.0]));
}

#[test]
fn a_demo_to_music_writes_every_result_and_says_that_a_model_hardly_trained_misses_its_goal() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("demo");
    let mut demo = demo(&out);
    demo.args(["--paper", "pu2022", "--fraction", "0.001"]);
    demo.assert()
        .code(4)
        .stdout(contains("consistency error").and(contains("with shifted beats at most")))
        .stderr(contains("does not keep to its key poses"));
    for row in ["evaluation.json", "hold.json", "interpolation.json"] {
        let scores = &json(&out.join(row))["music_dance"];
        assert!(scores["consistency"]["all"].is_number(), "{row}");
        assert!(scores["beat_hit_rate_shifted"]["3"].is_number(), "{row}");
    }
    let [dance, recorded] =
        ["dance.bvh", "recorded.bvh"].map(|name| bvh::read(&out.join(name)).unwrap().to_clip());
    assert_eq!(dance.poses.len(), recorded.poses.len());
    for file in ["song.wav", "viewer.html", "tables.md", "loss_curve.svg"] {
        assert!(fs::metadata(out.join(file)).unwrap().len() > 0, "{file}");
    }
}

#[test]
fn both_key_poses_and_beats_are_to_be_kept_to() {
    let scores = |consistency: f64, hits: f64, by_chance: f64| {
        let rows = [
            ("consistency", ScoreRow::new([("all", consistency)])),
            ("beat_hit_rate", ScoreRow::new([("3", hits)])),
            ("beat_hit_rate_shifted", ScoreRow::new([("3", by_chance)])),
        ];
        let scores = Scores::new(rows, [("all", 1), ("3", 1)]);
        ProtocolScores::new([("music_dance", scores)])
    };
    let reached = |consistency, hits, by_chance| {
        let held = scores(5.0, 2.0, 3.0);
        Goal::of(&scores(consistency, hits, by_chance), &held).is_reached()
    };
    assert!(reached(2.4, 50.1, 50.0));
    assert!(!reached(2.5, 50.1, 50.0));
    assert!(!reached(2.4, 50.0, 50.0));
    assert!(!reached(f64::NAN, 50.1, 50.0));
    let nothing = ProtocolScores::default();
    assert!(!Goal::of(&nothing, &nothing).is_reached());
}

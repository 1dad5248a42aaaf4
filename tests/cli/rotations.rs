//! Models of rotations through the binary: trained, resumed, scored, and asked for dances between
//! keyframes with contacts.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use assert_cmd::Command;
use keydance::motion::{Clip, Feet, bvh};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::trained_run::keydance;
use crate::viewer_page::page_data;

const LI: &str = "name = 'li'\n[data]\nsplit = { share = 0.8 }\n\
    [model]\nkind = 'li2023'\nwidth = 4\nheads = 2\nlayers = 2\n\
    [schedule]\nlengths = { min = 5, max = 50 }\nfraction = 0.0006\nbatch_size = 8\nshards = 2\n\
    [augmentation]\nmirror = true\ntempi = [1.25]\n[checkpoint]\nevery_steps = 4\n";
const DUAN: &str = "name = 'duan'\n[data]\nsplit = { share = 0.8 }\n\
    [model]\nkind = 'duan2022'\nwidth = 8\nheads = 2\nlayers = 1\nfeed_forward = 8\n\
    [schedule]\nfraction = 0.0003\nbatch_size = 8\n";

/// Six clips of 180 frames in `data`, the configs and a run of each.
struct Fixture {
    folder: TempDir,
}

static FIXTURE: LazyLock<Fixture> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    let fixture = Fixture { folder };
    fs::create_dir(fixture.path("data")).unwrap();
    write_clips(&fixture.path("data"), 180, 3);
    for (name, text) in [("li", LI), ("duan", DUAN)] {
        fs::write(fixture.path(&format!("{name}.toml")), text).unwrap();
        fixture.train(name, name).assert().success();
    }
    fixture
});

impl Fixture {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// `keydance train` of a config into a run.
    fn train(&self, config: &str, run: &str) -> Command {
        let mut command = keydance("train");
        command.arg(self.path(&format!("{config}.toml")));
        command.arg("--data").arg(self.path("data"));
        command.arg("--out").arg(self.path(run));
        command
    }

    fn clip(&self, index: usize) -> PathBuf {
        let entries = fs::read_dir(self.path("data")).unwrap();
        let mut clips: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        clips.sort();
        clips[index].clone()
    }

    /// `keydance generate` with a run, from frames of the first clip.
    fn generate(&self, run: &str, keyframes: &str, out: &Path) -> Command {
        let mut command = keydance("generate");
        command
            .arg(self.path(run))
            .arg("--motion")
            .arg(self.clip(0));
        command
            .args(["--keyframes", keyframes])
            .arg("--out")
            .arg(out);
        command
    }
}

fn read(path: &Path) -> Clip {
    bvh::read(path).unwrap().to_clip()
}

#[test]
fn scores_are_those_of_the_in_betweening_protocol_beside_the_papers() {
    for run in ["li", "duan"] {
        let mut command = keydance("evaluate");
        command
            .arg(FIXTURE.path(run))
            .arg("--data")
            .arg(FIXTURE.path("data"));
        let output = command.assert().success();
        output.stdout(contains("L2Q, local (norm)").and(contains("contact foot")));
        let scores = fs::read_to_string(FIXTURE.path(run).join("evaluation.json")).unwrap();
        let scores: Value = serde_json::from_str(&scores).unwrap();
        let scores = &scores["in_betweening"];
        assert!(scores["l2q_local"]["30"].as_f64().unwrap() > 0.0);
        assert_eq!(scores["windows"]["50"], scores["windows"]["10"]);
        let mut command = keydance("runs");
        let output = command.arg(FIXTURE.path(run)).assert().success();
        output.stdout(
            contains("L2Q, local")
                .and(contains("(N = 10)"))
                .and(contains("LRP").not()),
        );
    }
}

#[test]
fn lengths_that_a_model_was_not_trained_on_are_left_out_of_its_scores() {
    let folder = TempDir::new().unwrap();
    let scores = folder.path().join("scores.json");
    fs::write(
        FIXTURE.path("short.toml"),
        LI.replace("max = 50", "max = 20"),
    )
    .unwrap();
    FIXTURE.train("short", "short").assert().success();
    let evaluate = |more: &[&str]| {
        let mut command = keydance("evaluate");
        command.arg(FIXTURE.path("short"));
        command.arg("--data").arg(FIXTURE.path("data"));
        command.args(more).assert()
    };
    let output = evaluate(&["--json", scores.to_str().unwrap()]).success();
    output.stderr(contains("N = 30 is left out").and(contains("schedule.lengths.max")));
    let scores: Value = serde_json::from_slice(&fs::read(&scores).unwrap()).unwrap();
    let windows = scores["in_betweening"]["windows"].as_object().unwrap();
    assert_eq!(windows.keys().collect::<Vec<_>>(), ["10"]);
    let output = evaluate(&["--lengths", "30,40"]).failure();
    output.stderr(contains("at most 20 frames").and(contains("give smaller --lengths")));
}

#[test]
fn the_standing_foot_stands_still_and_keyframes_keep_their_poses() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let json = folder.path().join("dance.json");
    let mut command = FIXTURE.generate("li", "20,44,80", &out);
    let page = folder.path().join("dance.html");
    command
        .args(["--contacts", "left:0-9,right:10-24,both:25-60", "--json"])
        .arg(&json)
        .arg("--viewer")
        .arg(&page);
    command
        .assert()
        .success()
        .stdout(contains("the standing foot slides 0.00 cm/frame"));
    let (dance, recorded) = (read(&out), read(&FIXTURE.clip(0)));
    assert_eq!(dance.poses.len(), 61);
    for (frame, of_clip) in [(0, 20), (24, 44), (60, 80)] {
        let pairs = dance.poses[frame]
            .rotations
            .iter()
            .zip(&recorded.poses[of_clip].rotations);
        for (made, asked) in pairs {
            assert!(made.dot(*asked).abs() > 1.0 - 1e-9, "frame {frame}");
        }
    }
    // Which foot stands is the decoder's to say; one of them does, to nine decimals.
    let feet = Feet::of(&dance.skeleton).unwrap();
    let world = dance.skeleton.world_positions(&dance.poses);
    for (frame, pair) in world.windows(2).enumerate() {
        let moved = feet
            .ankles
            .map(|foot| pair[1][foot].distance(pair[0][foot]));
        assert!(moved[0].min(moved[1]) < 1e-6, "frame {frame}: {moved:?}");
    }
    let summary: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    let gap = summary["keyframes"][1]["root_gap"].as_f64().unwrap();
    let found = dance.poses[24].translations[0].distance(recorded.poses[44].translations[0]);
    assert!((gap - found).abs() < 1e-6, "{gap} {found}");
    assert_eq!(summary["units"]["root_gap"], "cm");
    // The page has the keyframes, in each frame one foot by its ankle and toe, and no body parts.
    let shown = page_data(&fs::read_to_string(&page).unwrap());
    let keyframes = shown["keyframes"].as_array().unwrap().iter();
    assert!(
        keyframes
            .map(|it| it["frame"].as_u64().unwrap())
            .eq([0, 24, 60])
    );
    let contacts = shown["motions"][0]["contacts"].as_array().unwrap().iter();
    let contacts: Vec<u64> = contacts.map(|it| it.as_u64().unwrap()).collect();
    assert_eq!(contacts.len(), 61);
    assert!(
        contacts.iter().all(|feet| [0b0011, 0b1100].contains(feet)),
        "{contacts:?}"
    );
    assert_eq!(shown["parts"], serde_json::json!([]));
}

#[test]
fn the_root_meets_the_keyframes_where_it_is_asked_to() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let mut command = FIXTURE.generate("li", "20,44,80", &out);
    command
        .args(["--set", "rtr.meet_target=linear"])
        .assert()
        .success();
    let (dance, recorded) = (read(&out), read(&FIXTURE.clip(0)));
    for (frame, of_clip) in [(24, 44), (60, 80)] {
        let place = dance.poses[frame].translations[0];
        assert!(place.distance(recorded.poses[of_clip].translations[0]) < 1e-6);
    }
}

#[test]
fn duan_goes_without_contacts_and_meets_the_root() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let mut command = FIXTURE.generate("duan", "20,60", &out);
    command.args(["--contacts", "left:0-40"]);
    let output = command.assert().success();
    output.stderr(contains("does not read contacts"));
    let (dance, recorded) = (read(&out), read(&FIXTURE.clip(0)));
    let place = dance.poses[40].translations[0];
    assert!(place.distance(recorded.poses[60].translations[0]) < 1e-6);
}

#[test]
fn what_cannot_be_completed_is_said_and_nothing_is_written() {
    let folder = TempDir::new().unwrap();
    let out = folder.path().join("dance.bvh");
    let cases = [
        (
            "20,60",
            "left:0-39",
            "frame 40 of the 41 frames of the result has no contact",
        ),
        (
            "20,60",
            "left:0-30,right:30-40",
            "frame 30 has two contacts",
        ),
        ("20,60", "left:0-41", "the frames of the result are 0 to 40"),
        ("20,60", "up:0-40", "expected FOOT:FIRST-LAST"),
        (
            "20,21",
            "left:0-1",
            "give keyframes that are at least 2 frames apart",
        ),
        (
            "20,75",
            "left:0-55",
            "the longest that it was trained on is 49",
        ),
    ];
    for (keyframes, contacts, message) in cases {
        let mut command = FIXTURE.generate("li", keyframes, &out);
        command.args(["--contacts", contacts]);
        command.assert().failure().stderr(contains(message));
        assert!(!out.exists(), "{message}");
    }
    let other = folder.path().join("other.bvh");
    let text = fs::read_to_string(FIXTURE.clip(0)).unwrap();
    fs::write(&other, text.replace("Neck", "Nape")).unwrap();
    let mut command = keydance("generate");
    command.arg(FIXTURE.path("li")).arg("--motion").arg(&other);
    command
        .args(["--keyframes", "20,50"])
        .arg("--out")
        .arg(&out);
    let output = command.assert().failure();
    output.stderr(contains(
        "joint 22 is Nape on Spine4 there, Neck on Spine4 here",
    ));
    assert!(!out.exists());
}

#[test]
fn figures_compare_the_methods_and_show_what_contacts_do() {
    let folder = TempDir::new().unwrap();
    let config = |name: &str, kind: &str| {
        let path = folder.path().join(format!("{name}.toml"));
        let split = "[data]\nsplit = { share = 0.8 }";
        let text =
            format!("name = '{name}'\npaper = 'li2023'\n{split}\n[model]\nkind = '{kind}'\n");
        fs::write(&path, text).unwrap();
        path
    };
    let out = folder.path().join("figures");
    let figures = |out: &Path| {
        let mut command = keydance("figures");
        command.arg(FIXTURE.path("li"));
        command.arg("--data").arg(FIXTURE.path("data"));
        command.arg("--out").arg(out);
        command
    };
    let mut command = figures(&out);
    let others = [
        config("mix_embedding", "held_pose"),
        config("slerp", "slerp"),
        FIXTURE.path("duan"),
    ];
    for other in &others {
        command.arg("--compare").arg(other);
    }
    command.assert().success();
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".svg"))
        .collect();
    names.sort();
    let expected = [10, 3, 5, 6, 7, 8, 9].map(|number| format!("figure_{number}.svg"));
    assert_eq!(names, expected);
    let numbers =
        |figure: &str| fs::read_to_string(out.join(figure).with_extension("csv")).unwrap();
    // The ablations stand in figure 3 alone.
    for (row, three, five) in [("duan", false, true), ("with E_m", true, false)] {
        assert_eq!(numbers("figure_3").contains(row), three, "{row}");
        assert_eq!(numbers("figure_5").contains(row), five, "{row}");
    }
    let value = |figure: &str, row: &str, measure: &str| -> f64 {
        let text = numbers(figure);
        let mut lines = csv::Reader::from_reader(text.as_bytes());
        let mut lines = lines.records().map(Result::unwrap);
        let line = lines.find(|line| &line[0] == row && &line[1] == measure);
        line.unwrap()[4].parse().unwrap()
    };
    // The foot that its contact decoder names stands.
    let [own, interpolated] =
        ["li", "Interpolation"].map(|row| value("figure_6", row, "contact_foot_speed_all_windows"));
    assert!(own < 1e-3 && interpolated > 0.05, "{own}, {interpolated}");

    let never = folder.path().join("never");
    let refused = |more: &[&str], message: &str| {
        let output = figures(&never).args(more).assert().failure();
        output.stderr(contains(message));
        assert!(!never.exists());
    };
    refused(&["--clip", "nobody.bvh"], "--clip nobody.bvh is not among");
    refused(&["--start", "9999"], "--start 9999");
    refused(&["--length", "400"], "no test clip has the 401 frames");
    refused(
        &["--length", "60"],
        "the longest that it was trained on is 49",
    );
}

#[test]
fn a_batch_of_each_model_is_exported_with_its_losses() {
    let folder = TempDir::new().unwrap();
    for run in ["li", "duan"] {
        let out = folder.path().join(run);
        let mut command = keydance("export-batch");
        command.arg(FIXTURE.path(run));
        command.arg("--data").arg(FIXTURE.path("data"));
        command.args(["--frames", "12", "--windows", "3"]);
        command.arg("--out").arg(&out);
        command.assert().success();
        command.args(["--force", "--ground-truth"]);
        let refused = command.assert().failure();
        refused.stderr(contains("--ground-truth: the model is never fed"));
        let batch = fs::read(&out).unwrap();
        let header = String::from_utf8_lossy(&batch[..batch.len().min(1 << 16)]).into_owned();
        for name in [
            "truth.rotations",
            "output.rotations",
            "loss.total",
            "gradient.",
        ] {
            assert!(header.contains(name), "{run}: {name}");
        }
    }
}

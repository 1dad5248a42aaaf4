//! `keydance reproduce` through the binary: every row trained once, whatever stops it, and tables
//! of what there is.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

use crate::folders::copy;
use crate::generated_data::write_clips;

const SMALL: &str =
    "hidden = 8\ncode = 8\nheads = 2\nfeed_forward = 8\nencoder_layers = 1\ndecoder_layers = 1\n";
const BUDGET: &str = "[data]\nsplit = { share = 0.8 }\nvalidation_share = 0.25\n\
    [schedule]\nmax_len = 6\nfraction = 0.05\nbatch_size = 8\nshards = 1\n\
    [optimiser]\ntransformer_learning_rate = 5e-5\n\
    [checkpoint]\nevery_steps = 3\n[validation]\nevery_steps = 5\nwindows = 2\nlengths = [10, 50]\n";

/// Data and configs.
struct Fixture {
    folder: TempDir,
}

impl Fixture {
    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

static FIXTURE: LazyLock<Fixture> = LazyLock::new(|| {
    let fixture = Fixture {
        folder: TempDir::new().unwrap(),
    };
    for folder in ["data", "configs"] {
        fs::create_dir(fixture.path(folder)).unwrap();
    }
    write_clips(&fixture.path("data"), 180, 3);
    let config = |name: &str, model: &str| {
        let text = format!("name = '{name}'\n[model]\n{model}");
        fs::write(fixture.path(&format!("configs/{name}.toml")), text).unwrap();
    };
    config("interpolation", "kind = 'interpolation'\n");
    config("whole_model", &format!("kind = 'pan2021'\n{SMALL}"));
    config("one_lstm", &format!("kind = 'pan2021'\nlstms = 1\n{SMALL}"));
    fs::write(fixture.path("budget.toml"), BUDGET).unwrap();
    fixture
});

/// `keydance reproduce` of the fixture's configs into `place`.
fn reproduce(place: &Path) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.args(arguments(place));
    command
}

fn arguments(place: &Path) -> Vec<PathBuf> {
    let mut arguments = vec!["reproduce".into(), FIXTURE.path("configs")];
    for (flag, path) in [
        ("--data", FIXTURE.path("data")),
        ("--budget", FIXTURE.path("budget.toml")),
        ("--out", place.join("results")),
        ("--runs", place.join("runs")),
    ] {
        arguments.extend([flag.into(), path]);
    }
    arguments
}

/// `keydance reproduce` into `place` with another folder in the place of one of the fixture's.
fn reproduce_with(place: &Path, fixture: &str, other: &Path) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.args(arguments(place).into_iter().map(|argument| {
        match argument == FIXTURE.path(fixture) {
            true => other.into(),
            false => argument,
        }
    }));
    command
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn weights(place: &Path, row: &str) -> String {
    let manifest = json(&place.join("results").join(row).join("manifest.json"));
    assert_eq!(manifest["state"], "finished");
    manifest["weights_digest"].as_str().unwrap().into()
}

/// A copy of everything that `reproduce` makes, made once.
static REPRODUCED: LazyLock<TempDir> = LazyLock::new(|| {
    let place = TempDir::new().unwrap();
    reproduce(place.path()).assert().success();
    place
});

/// The cells of the lines of a model in the table of LRP.
fn lrp_lines(place: &Path, model: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(place.join("results/tables.md")).unwrap();
    let table = text.split("## Table ").nth(1).unwrap();
    let cells = |line: &str| -> Vec<String> {
        let cells = line.trim_matches('|').split('|');
        cells.map(|cell| cell.trim().to_string()).collect()
    };
    let mut lines = table
        .lines()
        .filter(|line| line.starts_with('|'))
        .map(cells)
        .skip_while(|cells| cells[0] != model);
    let first = lines.next().unwrap();
    [first]
        .into_iter()
        .chain(lines.take_while(|cells| cells[0].is_empty()))
        .collect()
}

#[test]
fn every_config_becomes_a_row_with_scores_curves_and_a_manifest_of_all() {
    let place = REPRODUCED.path();
    for model in ["Interpolation", "One LSTM", "Whole model"] {
        let lines = lrp_lines(place, model);
        let kinds: Vec<&str> = lines.iter().map(|line| line[1].as_str()).collect();
        assert_eq!(kinds, ["paper", "ours", "difference"]);
        for line in &lines {
            assert!(line[2..].iter().all(|cell| cell.parse::<f64>().is_ok()));
        }
    }
    let tables = fs::read_to_string(place.join("results/tables.md")).unwrap();
    let manifest = json(&place.join("results/whole_model/manifest.json"));
    let whole = manifest["whole_schedule_frame_steps"].as_u64().unwrap();
    let done = manifest["frame_steps"].as_u64().unwrap();
    assert!((0.045..0.05).contains(&(done as f64 / whole as f64)));
    for words in [
        "One LSTM (seed 1), Whole model (seed 1): ",
        &format!("({:.3} % of the whole", 100.0 * done as f64 / whole as f64),
        "schedule.fraction 0.05, batch size 8, learning rate 0.0001 (0.00005 for transformers)",
        manifest["data_digest"].as_str().unwrap(),
    ] {
        assert!(tables.contains(words), "{words}: {tables}");
    }
    let all = json(&place.join("results/manifest.json"));
    let files = all["files"].as_object().unwrap();
    for name in [
        "tables.md",
        "lrp.svg",
        "interpolation/config.toml",
        "interpolation/evaluation.json",
        "whole_model/manifest.json",
        "whole_model/evaluation.json",
        "whole_model/loss_curve.svg",
        "one_lstm/validation_curve.svg",
    ] {
        let digest = files[name].as_str().unwrap();
        assert_eq!(digest.len(), 64, "{name}");
        assert!(place.join("results").join(name).exists());
    }
    let rows = all["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 3);
    assert!(rows.iter().all(|row| row["done"] == true));
}

#[test]
fn the_log_has_scores_on_validation_clips_at_their_interval_and_at_the_end() {
    let log = REPRODUCED.path().join("runs/whole_model/log.jsonl");
    let lines: Vec<Value> = fs::read_to_string(log)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let last = lines.len() as u64;
    for line in &lines {
        let step = line["step"].as_u64().unwrap();
        let scores = &line["validation"];
        assert_eq!(!scores.is_null(), step % 5 == 0 || step == last, "{step}");
        if !scores.is_null() {
            assert_eq!(scores["windows"]["50"], 2);
            assert!(scores["lrp"]["10"].as_f64().unwrap() > 0.0);
        }
    }
}

#[test]
fn scoring_on_validation_clips_leaves_the_weights_as_they_are() {
    let place = TempDir::new().unwrap();
    reproduce(place.path())
        .args(["--only", "whole_model", "--set", "validation.every_steps=1"])
        .assert()
        .success();
    assert_eq!(
        weights(place.path(), "whole_model"),
        weights(REPRODUCED.path(), "whole_model")
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_with_the_command_that_goes_on() {
    let place = TempDir::new().unwrap();
    let child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("keydance"))
        .args(arguments(place.path()))
        .args(["--set", "schedule.fraction=1"])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let checkpoints = place.path().join("runs/one_lstm/checkpoints");
    while !checkpoints.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let interrupt = ["-INT", &child.id().to_string()];
    let sent = std::process::Command::new("kill").args(interrupt).status();
    assert!(sent.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(
        stderr.contains("go on with\n  keydance reproduce ")
            && stderr.contains("--set schedule.fraction=1"),
        "{stderr}"
    );
    let manifest = json(&place.path().join("runs/one_lstm/manifest.json"));
    assert_eq!(manifest["state"], "stopped");
    assert!(!place.path().join("runs/whole_model").exists());
}

#[test]
fn what_is_done_is_not_done_again_even_where_only_the_small_results_are_left() {
    let place = TempDir::new().unwrap();
    copy(REPRODUCED.path(), place.path());
    fs::remove_dir_all(place.path().join("runs")).unwrap();
    let before = fs::read(place.path().join("results/tables.md")).unwrap();
    reproduce(place.path())
        .assert()
        .success()
        .stdout(contains("done, see").count(3));
    assert!(!place.path().join("runs").exists());
    assert_eq!(
        fs::read(place.path().join("results/tables.md")).unwrap(),
        before
    );
}

#[test]
fn a_killed_reproduction_goes_on_and_ends_at_the_same_weights() {
    let place = TempDir::new().unwrap();
    let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin!("keydance"))
        .args(arguments(place.path()))
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    let checkpoint = place.path().join("runs/one_lstm/checkpoints/step-00000003");
    while !checkpoint.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(checkpoint.exists());
    reproduce(place.path())
        .assert()
        .success()
        .stdout(contains("done, see").and(contains("goes on after step")));
    for row in ["one_lstm", "whole_model"] {
        assert_eq!(weights(place.path(), row), weights(REPRODUCED.path(), row));
    }
}

#[test]
fn rows_that_are_missing_keep_their_lines_with_a_dash() {
    let place = TempDir::new().unwrap();
    reproduce(place.path())
        .args(["--only", "interpolation,one_lstm", "--no-training"])
        .assert()
        .success()
        .stdout(contains("not trained yet"));
    let of = |model: &str| lrp_lines(place.path(), model);
    assert!(of("Interpolation")[1][2].parse::<f64>().is_ok());
    for model in ["One LSTM", "Whole model"] {
        assert_eq!(of(model)[1], ["", "ours", "—", "—", "—", "—", "—"]);
        assert_eq!(of(model)[2][1..3], ["difference", "—"]);
    }
    // Not a config of ours: the paper's line stands alone.
    assert_eq!(of("Condition-FC").len(), 1);
    let figure = fs::read_to_string(place.path().join("results/lrp.svg")).unwrap();
    assert!(figure.contains("Whole model, paper"), "{figure}");
}

#[test]
fn seeds_have_runs_of_their_own_and_show_their_spread() {
    let place = TempDir::new().unwrap();
    copy(REPRODUCED.path(), place.path());
    reproduce(place.path())
        .args(["--seeds", "whole_model=1,2"])
        .assert()
        .success();
    let lines = lrp_lines(place.path(), "Whole model");
    let kinds: Vec<&str> = lines.iter().map(|line| line[1].as_str()).collect();
    assert_eq!(
        kinds,
        [
            "paper",
            "ours, seed 1",
            "ours, seed 2",
            "ours, mean ± sd",
            "ours, min to max",
            "difference of the mean"
        ]
    );
    let of = |row: &str| weights(place.path(), row);
    assert_ne!(of("whole_model"), of("whole_model-seed-2"));
    assert_eq!(of("whole_model"), weights(REPRODUCED.path(), "whole_model"));
}

#[test]
fn results_and_runs_of_another_budget_or_other_data_are_refused_with_both_sides() {
    let place = TempDir::new().unwrap();
    copy(REPRODUCED.path(), place.path());
    let other_budget = || {
        let mut command = reproduce(place.path());
        command.args(["--set", "schedule.fraction=0.04"]);
        command
    };
    let refused = other_budget().assert().failure();
    refused.stderr(
        contains("schedule.fraction: 0.05, 0.04")
            .and(contains("results"))
            .and(contains("remove")),
    );
    let other_data = TempDir::new().unwrap();
    write_clips(other_data.path(), 180, 4);
    let on_other_data = || reproduce_with(place.path(), "data", other_data.path());
    let digest = json(&place.path().join("results/manifest.json"))["data_digest"]
        .as_str()
        .unwrap()
        .to_string();
    let refused = on_other_data().assert().failure();
    refused.stderr(contains(&digest).and(contains("has digest")));
    // The same of the runs, where there are no results.
    fs::remove_dir_all(place.path().join("results")).unwrap();
    let refused = other_budget().assert().failure();
    refused.stderr(contains("schedule.fraction: 0.05, 0.04").and(contains("runs")));
    let refused = on_other_data().assert().failure();
    refused.stderr(contains(&digest).and(contains("now has digest")));
}

#[test]
fn velocity_refinement_scores_the_same_weights_anew() {
    let place = TempDir::new().unwrap();
    copy(REPRODUCED.path(), place.path());
    let one = TempDir::new().unwrap();
    fs::copy(
        FIXTURE.path("configs/whole_model.toml"),
        one.path().join("whole_model.toml"),
    )
    .unwrap();
    let refined = || {
        let mut command = reproduce_with(place.path(), "configs", one.path());
        command.args(["--set", "model.velocity_refinement=true"]);
        command
    };
    let refused = refined().assert().failure();
    refused.stderr(contains("model.velocity_refinement: false, true").and(contains("remove")));
    fs::remove_dir_all(place.path().join("results")).unwrap();
    refined().assert().success();
    assert_eq!(
        weights(place.path(), "whole_model"),
        weights(REPRODUCED.path(), "whole_model")
    );
    let lrp = |place: &TempDir| lrp_lines(place.path(), "Whole model");
    assert_ne!(lrp(&place), lrp(&REPRODUCED));
}

#[test]
fn rows_trained_at_the_same_time_end_as_one_after_the_other() {
    let place = TempDir::new().unwrap();
    let mut command = reproduce(place.path());
    let done = command.args(["--jobs", "2", "--threads", "2"]).assert();
    done.success().stderr(contains("whole_model: step "));
    for row in ["whole_model", "one_lstm"] {
        let before = weights(REPRODUCED.path(), row);
        assert_eq!(weights(place.path(), row), before, "{row}");
    }
    for file in ["tables.md", "interpolation/evaluation.json"] {
        let [there, here] = [REPRODUCED.path(), place.path()]
            .map(|path| fs::read_to_string(path.join("results").join(file)).unwrap());
        assert_eq!(there, here, "{file}");
    }
}

#[test]
fn a_row_that_begins_with_the_weights_of_another_is_listed_before_these_are_trained() {
    let place = TempDir::new().unwrap();
    let configs = place.path().join("configs");
    fs::create_dir(&configs).unwrap();
    let first = FIXTURE.path("configs").join("one_lstm.toml");
    fs::copy(&first, configs.join("one_lstm.toml")).unwrap();
    let base = FIXTURE.path("configs").join("whole_model.toml");
    fs::copy(&base, configs.join("whole_model.toml")).unwrap();
    let further = "base = 'one_lstm.toml'\nname = 'further'\nstart = 'one_lstm'\n";
    fs::write(configs.join("further.toml"), further).unwrap();
    let mut command = reproduce_with(place.path(), "configs", &configs);
    let listed = command.arg("--list").assert().success();
    let text = String::from_utf8(listed.get_output().stdout.clone()).unwrap();
    let row = text.lines().find(|line| line.ends_with("further"));
    let hours: f64 = row.unwrap().split('\t').nth(1).unwrap().parse().unwrap();
    assert!(hours >= 0.0 && hours.is_finite());
}

#[test]
fn tasks_in_processes_of_their_own_at_the_same_time_make_the_tables_of_one() {
    let place = TempDir::new().unwrap();
    // Refined or not, weights are the same: one task.
    let configs = place.path().join("configs");
    fs::create_dir(&configs).unwrap();
    for file in fs::read_dir(FIXTURE.path("configs")).unwrap() {
        let file = file.unwrap().path();
        fs::copy(&file, configs.join(file.file_name().unwrap())).unwrap();
    }
    let refined = "base = 'one_lstm.toml'\nname = 'refined'\n[model]\nvelocity_refinement = true\n";
    fs::write(configs.join("refined.toml"), refined).unwrap();
    let command = |place: &Path| reproduce_with(place, "configs", &configs);
    let list = |place: &Path| {
        let output = command(place).arg("--list").assert().success();
        let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
        let lines = text.lines().map(|line| {
            let cells: Vec<String> = line.split('\t').map(String::from).collect();
            (
                cells[0].clone(),
                cells[1].parse::<f64>().unwrap(),
                cells[2].clone(),
            )
        });
        lines.collect::<Vec<_>>()
    };
    let tasks = list(place.path());
    let rows: Vec<&str> = tasks.iter().map(|(_, _, rows)| rows.as_str()).collect();
    assert_eq!(rows, ["interpolation", "one_lstm,refined", "whole_model"]);
    assert!(tasks[0].1 == 0.0 && tasks[1].1 >= 0.0);
    let running: Vec<_> = tasks
        .iter()
        .map(|(number, ..)| {
            let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin!("keydance"));
            command.args(arguments(place.path()).into_iter().map(|argument| {
                match argument == FIXTURE.path("configs") {
                    true => configs.clone(),
                    false => argument,
                }
            }));
            command.args(["--task", number, "--threads", "1"]);
            command.stdout(std::process::Stdio::null()).spawn().unwrap()
        })
        .collect();
    for mut task in running {
        assert!(task.wait().unwrap().success());
    }
    assert!(!place.path().join("results/tables.md").exists());
    let output = command(place.path())
        .args(["--task", "4"])
        .assert()
        .failure();
    output.stderr(contains("--task 4: there are 3"));
    command(place.path())
        .arg("--no-training")
        .assert()
        .success();
    let alone = TempDir::new().unwrap();
    command(alone.path()).assert().success();
    let tables = |place: &Path| fs::read_to_string(place.join("results/tables.md")).unwrap();
    assert_eq!(tables(place.path()), tables(alone.path()));
}

#[test]
fn rows_that_could_not_be_trained_are_refused_before_any_is() {
    let place = TempDir::new().unwrap();
    for (set, words) in [
        (
            "validation.lengths=[5, 4000]",
            "validation.lengths has 4000",
        ),
        ("model.lstms=2", "interpolation.toml is no row"),
        ("schedule.batch_size=8192", "the schedule has no step"),
    ] {
        let refused = reproduce(place.path()).args(["--set", set]).assert();
        refused.failure().stderr(contains(words));
    }
    assert!(!place.path().join("runs").exists());
}

#[test]
fn names_and_seeds_that_no_config_has_are_errors_that_list_those_there_are() {
    let place = TempDir::new().unwrap();
    for (arguments, words) in [
        (["--only", "two_lstms"], "has no such config"),
        (["--seeds", "two_lstms=1,2"], "has no such config"),
        (["--seeds", "whole_model=1,x"], "such as mine=1,2,3"),
        (["--seeds", "whole_model=1,1"], "twice"),
    ] {
        let refused = reproduce(place.path()).args(arguments).assert().failure();
        refused.stderr(contains(words).and(contains("whole_model")));
    }
    let budget = place.path().join("budget.toml");
    fs::write(
        &budget,
        format!("{BUDGET}[rows.two_lstms.schedule]\nfraction = 0.1\n"),
    )
    .unwrap();
    let refused = reproduce_with(place.path(), "budget.toml", &budget).assert();
    let says = contains("rows two_lstms").and(contains("has no such config"));
    refused.failure().stderr(says);
    let empty = TempDir::new().unwrap();
    Command::cargo_bin("keydance")
        .unwrap()
        .arg("reproduce")
        .arg(empty.path())
        .arg("--data")
        .arg(FIXTURE.path("data"))
        .arg("--out")
        .arg(place.path().join("results"))
        .assert()
        .failure()
        .stderr(contains("holds no config"));
}

#[test]
fn a_folder_of_other_files_is_not_taken_for_results_because_rows_are_trained() {
    let place = TempDir::new().unwrap();
    for (row, kept) in [
        ("interpolation", "results"),
        ("whole_model", "runs/whole_model"),
    ] {
        let folder = place.path().join(kept);
        fs::create_dir_all(&folder).unwrap();
        fs::create_dir_all(place.path().join("runs/interpolation")).unwrap();
        fs::write(folder.join("mine.md"), "my own").unwrap();
        let refused = reproduce(place.path())
            .args(["--only", row])
            .assert()
            .failure();
        refused.stderr(contains("files"));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(&folder).unwrap();
    }
}

#[test]
fn a_key_of_one_model_reaches_only_the_rows_that_know_it() {
    let place = TempDir::new().unwrap();
    let set = ["--set", "model.loss.key=0", "--only"];
    reproduce(place.path())
        .args(set)
        .arg("one_lstm")
        .assert()
        .success();
    let loss = |row: &str| {
        let config = fs::read_to_string(place.path().join("results").join(row).join("config.toml"));
        let config: toml::Table = config.unwrap().parse().unwrap();
        config["model"]["loss"]["key"].as_float()
    };
    assert_eq!(loss("one_lstm"), Some(0.0));
    // A row that is asked for and has no such key is refused with it.
    reproduce(place.path())
        .args(set)
        .arg("interpolation")
        .assert()
        .failure()
        .stderr(contains("--set model.loss.key=0").and(contains("interpolation.toml")));
}

#[test]
fn scores_that_lack_a_protocol_are_made_again_from_the_run_and_stay_where_it_is_gone() {
    let place = TempDir::new().unwrap();
    copy(REPRODUCED.path(), place.path());
    let scores = place.path().join("results/whole_model/evaluation.json");
    let mut earlier = json(&scores);
    earlier.as_object_mut().unwrap().remove("published");
    fs::write(&scores, earlier.to_string()).unwrap();
    let runs = place.path().join("runs");
    fs::rename(&runs, place.path().join("away")).unwrap();
    let kept = reproduce(place.path()).arg("--no-training").assert();
    let note = contains("not scored by published").and(contains("has no run of it"));
    kept.success().stdout(note);
    assert_eq!(json(&scores), earlier);
    assert_eq!(lrp_lines(place.path(), "Whole model").len(), 1);
    fs::rename(place.path().join("away"), &runs).unwrap();
    reproduce(place.path()).assert().success();
    let before = json(
        &REPRODUCED
            .path()
            .join("results/whole_model/evaluation.json"),
    );
    assert_eq!(json(&scores), before);
}

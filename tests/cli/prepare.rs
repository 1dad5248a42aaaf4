//! `keydance prepare`, and its file in place of a folder.

use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;

use crate::generated_data::write_clips;

fn keydance(name: &str) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.arg(name);
    command
}

fn prepared(folder: &Path) -> std::path::PathBuf {
    let dances = folder.join("dances");
    std::fs::create_dir(&dances).unwrap();
    write_clips(&dances, 80, 2);
    let file = folder.join("dances.prepared");
    let mut command = keydance("prepare");
    command.arg(&dances).arg("--out").arg(&file);
    let done = command.assert().success();
    done.stdout(contains("6 clips, 480 frames, 0.4 MB"));
    file
}

#[test]
fn a_model_is_trained_and_scored_on_the_file_as_on_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let file = prepared(folder.path());
    let dances = folder.path().join("dances");
    let ends = [&dances, &file].map(|data| {
        let run = folder.path().join(format!("run{}", data.is_file()));
        let mut command = keydance("train");
        command.args(["experiments/demo.toml", "--threads", "2", "--data"]);
        command.arg(data).arg("--out").arg(&run);
        for set in [
            "schedule.fraction=0.05",
            "schedule.batch_size=16",
            "model.hidden=16",
        ] {
            command.args(["--set", set]);
        }
        let output = command.assert().success().get_output().stdout.clone();
        let mut command = keydance("evaluate");
        command.arg(&run).arg("--data").arg(data);
        command.args(["--windows", "8", "--lengths", "10,30"]);
        let scores = command.assert().success().get_output().stdout.clone();
        let scores = String::from_utf8(scores).unwrap();
        // The first line names the run.
        let scores = scores.lines().skip(1).map(String::from).collect::<Vec<_>>();
        assert!(scores.len() > 10, "{scores:?}");
        let weights = String::from_utf8(output).unwrap();
        let weights = weights.lines().last().unwrap().to_string();
        assert!(weights.starts_with("weights "), "{weights}");
        (weights, scores)
    });
    assert_eq!(ends[0], ends[1]);
}

#[test]
fn a_file_that_is_there_is_replaced_only_if_asked_and_never_a_clip() {
    let folder = tempfile::tempdir().unwrap();
    let file = prepared(folder.path());
    let dances = folder.path().join("dances");
    let again = |out: &Path, more: &[&str]| {
        let mut command = keydance("prepare");
        command.arg(&dances).arg("--out").arg(out).args(more);
        command.assert()
    };
    again(&file, &[])
        .failure()
        .stderr(contains("is there already; --force replaces it"));
    again(&file, &["--force"]).success();
    let clip = dances.join("choreography_000_waltz.bvh");
    again(&clip, &["--force"]).failure();
    let mine = folder.path().join("mine.toml");
    std::fs::write(&mine, "name = 'mine'\n").unwrap();
    again(&mine, &["--force"])
        .failure()
        .stderr(contains("is there and no prepared set"));
    assert!(std::fs::read_to_string(&mine).unwrap().contains("mine"));
    again(&folder.path().join("nowhere/"), &[])
        .failure()
        .stderr(contains("is a folder; name a file in it"));
}

#[test]
fn a_command_that_takes_one_clip_says_that_a_prepared_set_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let file = prepared(folder.path());
    for (name, out) in [("view", "--out"), ("features", "--npy")] {
        let mut command = keydance(name);
        command
            .arg(&file)
            .arg(out)
            .arg(folder.path().join("written"));
        let says = "expected a BVH file, text that begins with HIERARCHY";
        command
            .assert()
            .failure()
            .stderr(contains(says).and(contains("KDPOSES")));
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_as_data_is_refused_as_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("pipe");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let mut command = keydance("train");
    command.args(["experiments/demo.toml", "--data"]).arg(&pipe);
    command.arg("--out").arg(folder.path().join("run"));
    command
        .assert()
        .failure()
        .stderr(contains("is a pipe or a device"));
}

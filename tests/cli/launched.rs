//! A program that was built without MPI, as one of several processes that an MPI launcher starts.

use assert_cmd::Command;
use predicates::str::{contains, is_empty};

fn launched(rank: &str, arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.env("OMPI_COMM_WORLD_RANK", rank);
    command.env("OMPI_COMM_WORLD_SIZE", "2");
    command.args(arguments);
    command
}

#[cfg(not(feature = "mpi"))]
#[test]
fn a_training_says_on_any_rank_that_it_would_be_alone() {
    for rank in ["0", "1"] {
        let arguments = ["train", "x.toml", "--data", "x", "--out", "x"];
        let failed = launched(rank, &arguments).assert().failure();
        let says = format!("error: this is rank {rank} of 2 of an MPI launcher");
        failed
            .stderr(contains(says))
            .stderr(contains("--features mpi"));
    }
}

#[test]
fn commands_that_share_no_work_are_refused_and_told_once() {
    let arguments = ["runs", "x"];
    let failed = launched("0", &arguments).assert().failure();
    failed.stderr(contains(
        "2 ranks of an MPI launcher: train and bench-step alone",
    ));
    let failed = launched("1", &arguments).assert().failure();
    failed.stderr(is_empty());
    // A mistake of the command line, too.
    let failed = launched("0", &["trian"]).assert().failure();
    failed.stderr(contains("trian"));
    launched("1", &["trian"])
        .assert()
        .failure()
        .stderr(is_empty());
}

#[test]
fn a_launcher_of_one_process_changes_nothing() {
    let mut command = launched("0", &["completions", "bash"]);
    command.env("OMPI_COMM_WORLD_SIZE", "1");
    command.assert().success().stdout(contains("keydance"));
}

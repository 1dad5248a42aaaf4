//! Sampled dances through the binary: the reduced demo, and what is asked of its run.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use keydance::motion::bvh;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use tempfile::TempDir;

fn keydance(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::cargo_bin("keydance").unwrap();
    command.current_dir(folder).args(args);
    command
}

#[test]
fn the_reduced_demo_dances_on_and_its_run_makes_several_dances_of_one_seed() {
    let folder = TempDir::new().unwrap();
    let path = folder.path();
    let demo = [
        "demo",
        "--paper",
        "valleperez2021",
        "--reduced",
        "--out",
        "demo",
    ];
    keydance(path, &demo)
        .assert()
        .success()
        .stdout(contains("0 % of the dances freeze, 0 % diverge"));
    for file in [
        "dance_3.bvh",
        "song.wav",
        "viewer.html",
        "tables.md",
        "loss_curve.svg",
    ] {
        assert!(
            fs::metadata(path.join("demo").join(file)).unwrap().len() > 0,
            "{file}"
        );
    }

    let song = [
        "--music",
        "demo/song.wav",
        "--seed-motion",
        "demo/recorded.bvh:0",
    ];
    let dances = |more: &[&str]| {
        let all = [&["generate", "demo"][..], &song, more].concat();
        keydance(path, &all)
    };
    let several = [
        "--seed", "7", "--count", "2", "--until", "6s", "--out", "a.bvh",
    ];
    dances(&[&several[..], &["--viewer", "a.html", "--json", "a.json"]].concat())
        .assert()
        .success()
        .stdout(contains("a_1.bvh").and(contains("frames a second")));
    let page = fs::read_to_string(path.join("a.html")).unwrap();
    assert!(page.contains("demo_valleperez2021 2"));
    let summary = fs::read_to_string(path.join("a.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert_eq!(summary.as_array().unwrap().len(), 2);
    let read = |name: &str| bvh::read(&path.join(name)).unwrap().to_clip();
    let (first, second) = (read("a_1.bvh"), read("a_2.bvh"));
    assert_eq!((first.poses.len(), second.poses.len()), (120, 120));
    assert_eq!(first.poses[39], second.poses[39], "the seed is the same");
    assert_ne!(first.poses[60], second.poses[60], "what follows is not");

    // The second of seed 7 is the first of seed 8, and a file that is there stays.
    dances(&["--seed", "8", "--until", "6s", "--out", "b.bvh"])
        .assert()
        .success();
    assert_eq!(read("b.bvh").poses, second.poses);
    dances(&several)
        .assert()
        .failure()
        .stderr(contains("a_1.bvh").and(contains("--force")));

    let clamped = [
        "--set",
        "generation.temperature=1000",
        "--until",
        "6s",
        "--out",
        "c.bvh",
    ];
    dances(&clamped)
        .assert()
        .failure()
        .stderr(contains("diverges: frame 40").and(contains("generation.clamp")));
    assert!(!path.join("c.bvh").exists());
    dances(&[&clamped[..], &["--set", "generation.clamp=4.0"]].concat())
        .assert()
        .success();
    keydance(
        path,
        &["generate", "demo", "--count", "2", "--out", "d.bvh"],
    )
    .assert()
    .failure()
    .stderr(contains("--music"));
}

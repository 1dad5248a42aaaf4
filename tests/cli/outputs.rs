//! What commands write: never over what they read, over other files only with `--force`, each file
//! whole or not at all.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use tempfile::TempDir;

use crate::folders::{copy, files};
use crate::trained_run::{TrainedRun, keydance};

static FIXTURE: LazyLock<TrainedRun> = LazyLock::new(TrainedRun::new);

/// A copy of the fixture to work in, a run in it evaluated.
fn place() -> TempDir {
    static EVALUATED: LazyLock<()> = LazyLock::new(|| {
        let output = run(&FIXTURE.path(""), &["evaluate", "run", "--data", "data"]);
        assert!(output.status.success(), "{output:?}");
    });
    LazyLock::force(&EVALUATED);
    let place = TempDir::new().unwrap();
    copy(&FIXTURE.path(""), place.path());
    let clip = clips(place.path()).swap_remove(0);
    fs::copy(clip, place.path().join("a.bvh")).unwrap();
    place
}

fn clips(place: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(place.join("data")).unwrap();
    let mut clips: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    clips.sort();
    clips
}

fn run(place: &Path, words: &[&str]) -> Output {
    let mut command = keydance(words[0]);
    command.args(&words[1..]).current_dir(place);
    command.output().unwrap()
}

/// The command is refused with these words, and nothing is written.
fn refused(place: &Path, command: &str, message: &str) {
    let before = files(place);
    let words: Vec<&str> = command.split(' ').collect();
    let output = run(place, &words);
    let text = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{command}: {text}");
    assert!(text.contains(message), "{command}: {text}");
    let after = files(place);
    let changed = after
        .iter()
        .filter(|(path, content)| before.get(*path) != Some(content));
    let changed: Vec<&PathBuf> = changed.map(|(path, _)| path).collect();
    assert!(
        changed.is_empty() && after.len() == before.len(),
        "{command}: {changed:?}"
    );
}

const GENERATE: &str = "generate interpolation.toml --motion a.bvh --keyframes 0,40";

#[test]
fn an_output_that_is_an_input_by_whatever_name_or_link_is_refused() {
    let folder = place();
    let place = folder.path();
    fs::create_dir(place.join("sub")).unwrap();
    fs::hard_link(place.join("a.bvh"), place.join("hard.bvh")).unwrap();
    symlink("a.bvh", place.join("soft.bvh")).unwrap();
    symlink("../soft.bvh", place.join("sub/soft.bvh")).unwrap();
    symlink("../run/weights.safetensors", place.join("sub/weights")).unwrap();
    fs::hard_link(place.join("run/weights.safetensors"), place.join("hard")).unwrap();
    fs::write(place.join("own.toml"), "base = 'interpolation.toml'").unwrap();
    let rows: String = (0..41).map(|frame| format!("{frame},0,90,0\n")).collect();
    fs::write(place.join("way.csv"), format!("frame,x,y,z\n{rows}")).unwrap();
    let map = joints_onto_themselves();
    fs::write(place.join("map.toml"), map).unwrap();

    let absolute = place.join("a.bvh").display().to_string();
    let names = [
        "a.bvh",
        "./a.bvh",
        "sub/../a.bvh",
        "hard.bvh",
        "soft.bvh",
        "sub/soft.bvh",
    ];
    for name in names.into_iter().chain([&*absolute]) {
        let said = "is what the command reads (a.bvh)";
        refused(place, &format!("{GENERATE} --out {name}"), said);
        refused(place, &format!("{GENERATE} --out {name} --force"), said);
        refused(
            place,
            &format!("{GENERATE} --out new.bvh --viewer {name} --force"),
            said,
        );
        refused(place, &format!("features a.bvh --npy {name} --force"), said);
    }
    let reads = "is what the command reads";
    for command in [
        "generate own.toml --motion a.bvh --keyframes 0,40 --out interpolation.toml --force",
        &format!("{GENERATE} --trajectory way.csv --out new.bvh --json way.csv --force"),
        &format!("{GENERATE} --velocity-from hard.bvh:3 --out hard.bvh --force"),
        "features a.bvh --mapping map.toml --npy map.toml --force",
        "evaluate own.toml --set data.mapping=map.toml --data data --json map.toml --force",
        "export-batch run --data data --out hard --force",
        "tables run --out hard --force",
    ] {
        refused(place, command, reads);
    }
    let clip = clips(place).swap_remove(0);
    let clip = clip.strip_prefix(place).unwrap().display().to_string();
    refused(
        place,
        &format!("evaluate run --data data --json {clip} --force"),
        reads,
    );
    refused(
        place,
        &format!("figures run --data data --out new --viewer {clip} --force"),
        reads,
    );
    let part = "is a part of the run in";
    refused(
        place,
        "export-batch run --data data --out sub/weights --force",
        part,
    );
    refused(
        place,
        "evaluate run --data data --json sub/weights --force",
        part,
    );
}

/// The text of a mapping of the dance skeleton onto itself.
fn joints_onto_themselves() -> String {
    let joints = keydance::motion::skeleton::DANCE_JOINTS.iter();
    let joints: String = joints
        .map(|name| format!("{name} = \"{name}\"\n"))
        .collect();
    format!("[joints]\n{joints}")
}

#[test]
fn what_is_there_stays_unless_force_is_given() {
    let folder = place();
    let place = folder.path();
    let earlier = |name: &str| fs::write(place.join(name), "earlier").unwrap();
    for (command, outputs) in [
        (
            GENERATE,
            ["--out new.bvh", "--viewer new.html", "--json new.json"].as_slice(),
        ),
        ("features a.bvh", &["--npy new.npy"]),
        (
            "evaluate run --data data --lengths 10",
            &["--json new.json"],
        ),
        (
            "export-batch run --data data --frames 5 --windows 2",
            &["--out new.safetensors"],
        ),
        ("tables run", &["--out tables.md"]),
        (
            "figures run --data data --length 20 --out new",
            &["--viewer new.html"],
        ),
    ] {
        for output in outputs {
            let (_, name) = output.split_once(' ').unwrap();
            let others = outputs.iter().filter(|other| *other != output);
            let others: String = others.map(|other| format!(" {other}")).collect();
            let command = format!("{command}{others} {output}");
            earlier(name);
            refused(
                place,
                &command,
                &format!("{name} is there already; --force replaces it"),
            );
            let words: Vec<&str> = command.split(' ').chain(["--force"]).collect();
            let output = run(place, &words);
            assert!(output.status.success(), "{command}: {output:?}");
            assert_ne!(fs::read(place.join(name)).unwrap(), b"earlier");
            for written in outputs {
                fs::remove_file(place.join(written.split_once(' ').unwrap().1)).unwrap();
            }
        }
    }
    // The figures' folder is there by now.
    let figures = "figures run --data data --length 20 --out new";
    refused(place, figures, "new holds files already; --force");
    let words: Vec<&str> = figures.split(' ').chain(["--force"]).collect();
    assert!(run(place, &words).status.success());
    refused(
        place,
        "figures run --data data --length 20 --out a.bvh",
        "a.bvh is not a folder",
    );
    refused(
        place,
        "choreography --out data --clips 1 --frames 40",
        "data holds files already",
    );
    refused(
        place,
        &format!("{GENERATE} --out new --force"),
        "new is a folder",
    );
    refused(
        place,
        &format!("{GENERATE} --out x.bvh --json X.bvh"),
        "is to be written twice",
    );
    refused(
        place,
        "evaluate interpolation.toml --data data --out new",
        "new holds files already",
    );
    symlink("nowhere", place.join("link")).unwrap();
    refused(place, "features a.bvh --npy link", "link is there already");
}

#[test]
fn an_output_in_a_folder_that_is_not_there_is_refused_before_anything_is_written() {
    let folder = place();
    let place = folder.path();
    let generate = format!("{GENERATE} --out new.bvh");
    for command in [
        &format!("{GENERATE} --out no/new.bvh"),
        &format!("{generate} --viewer no/page.html"),
        &format!("{generate} --json no/new.json"),
        "features a.bvh --npy no/new.npy",
        "evaluate run --data data --json no/new.json",
        "evaluate interpolation.toml --data data --out scores --json no/new.json",
        "export-batch run --data data --out no/new.safetensors",
        "tables run --out no/tables.md",
        "figures run --data data --out new --viewer no/page.html",
    ] {
        refused(place, command, "cannot be written: there is no folder no;");
        refused(
            place,
            &format!("{command} --force"),
            "there is no folder no;",
        );
    }
}

#[test]
fn what_a_run_consists_of_is_written_by_the_run_alone() {
    let folder = place();
    let place = folder.path();
    copy(&place.join("run"), &place.join("other"));
    fs::remove_file(place.join("other/evaluation.json")).unwrap();
    let checkpoints = fs::read_dir(place.join("run/checkpoints")).unwrap();
    let checkpoint = checkpoints
        .map(|entry| entry.unwrap().path())
        .max()
        .unwrap();
    let state = checkpoint.strip_prefix(place).unwrap().join("state.bin");
    let state = state.display().to_string();
    for part in [
        "run/weights.safetensors",
        "run/config.toml",
        "run/manifest.json",
        "run/log.jsonl",
        "run/evaluation.json",
        "run/evaluation_validation.json",
        "other/evaluation.json",
        "other/weights.safetensors",
        &state,
    ] {
        for command in [
            &format!("evaluate run --data data --lengths 10 --json {part} --force"),
            &format!("tables run --out {part} --force"),
            &format!("{GENERATE} --out {part} --force"),
        ] {
            refused(place, command, "is a part of the run in");
        }
    }
    refused(
        place,
        "evaluate interpolation.toml --data data --out run",
        "another config",
    );
    let reproduce = "reproduce configs --data data --out run --runs runs --force";
    fs::create_dir(place.join("configs")).unwrap();
    fs::copy(
        place.join("interpolation.toml"),
        place.join("configs/a.toml"),
    )
    .unwrap();
    refused(place, reproduce, "run is a run's folder");
}

#[test]
fn what_a_user_keeps_in_a_runs_folder_is_written_and_replaced_as_elsewhere() {
    let folder = place();
    let place = folder.path();
    for command in [
        "generate run --motion a.bvh --keyframes 0,40 --out run/new.bvh",
        "evaluate run --data data --lengths 10 --json run/new.json",
        "tables run --out run/tables.md",
        "figures run --data data --length 20 --out run/figures --viewer run/figures/new.html",
        // As above, and the scores in the folder that it makes.
        "evaluate interpolation.toml --data data --out scores --json scores/new.json",
    ] {
        let words: Vec<&str> = command.split(' ').collect();
        let output = run(place, &words);
        assert!(output.status.success(), "{command}: {output:?}");
        refused(place, command, "--force");
        let output = run(place, &[&words[..], &["--force"]].concat());
        assert!(output.status.success(), "{command}: {output:?}");
    }
}

#[test]
fn a_dance_does_not_become_one_of_the_clips_unnoticed() {
    let folder = place();
    let place = folder.path();
    let clip = clips(place).swap_remove(0);
    let clip = clip.strip_prefix(place).unwrap().display().to_string();
    let from = |model: &str| format!("generate {model} --motion {clip} --keyframes 0,40");
    let said = "would be one of the clips that small was trained on";
    refused(
        place,
        &format!("{} --out data/new.bvh --force", from("run")),
        said,
    );
    let said = "would be one of the clips in data";
    refused(place, "evaluate run --data data --json data/new.bvh", said);
    let command = format!("{} --out data/new.bvh", from("interpolation.toml"));
    let output = run(place, &command.split(' ').collect::<Vec<_>>());
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(
        text.contains("warning: data/new.bvh lies beside 5 other clips"),
        "{text}"
    );
}

#[test]
fn a_disk_that_takes_no_more_leaves_the_earlier_file_whole_and_nothing_beside_it() {
    let folder = place();
    let place = folder.path();
    let written = run(
        place,
        &format!("{GENERATE} --out new.bvh")
            .split(' ')
            .collect::<Vec<_>>(),
    );
    assert!(written.status.success());
    let before = files(place);
    // A limit on the size of a file, in blocks of 512 or 1024 bytes.
    let output = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
        .arg(assert_cmd::cargo::cargo_bin!("keydance"))
        .args(GENERATE.replace("40", "150").split(' '))
        .args(["--out", "new.bvh", "--force"])
        .current_dir(place)
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(
        text.contains("new.bvh cannot be written: File too large"),
        "{text}"
    );
    assert_eq!(files(place), before);
}

#[test]
fn a_link_stays_a_link_and_a_pipe_is_written_to() {
    let folder = place();
    let place = folder.path();
    fs::write(place.join("real.npy"), "earlier").unwrap();
    symlink("real.npy", place.join("link.npy")).unwrap();
    let output = run(
        place,
        &["features", "a.bvh", "--npy", "link.npy", "--force"],
    );
    assert!(output.status.success(), "{output:?}");
    assert!(place.join("link.npy").is_symlink());
    assert!(
        fs::read(place.join("real.npy"))
            .unwrap()
            .starts_with(b"\x93NUMPY")
    );

    let pipe = place.join("pipe");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let reader = std::thread::spawn(move || fs::read(pipe).unwrap());
    assert!(
        run(place, &["features", "a.bvh", "--npy", "pipe"])
            .status
            .success()
    );
    assert!(reader.join().unwrap().starts_with(b"\x93NUMPY"));
}

#[test]
fn a_demo_and_a_table_take_the_place_of_their_own_results_only() {
    let folder = place();
    let place = folder.path();
    fs::create_dir(place.join("notes")).unwrap();
    fs::write(place.join("notes/tables.md"), "mine").unwrap();
    refused(
        place,
        "demo --reduced --out notes",
        "notes holds other files than a demo's",
    );
    refused(
        place,
        "demo --reduced --out run",
        "run holds a run already, which is no demo",
    );
    for config in ["one", "two"] {
        fs::create_dir(place.join(config)).unwrap();
        let text = fs::read_to_string(place.join("interpolation.toml")).unwrap();
        let text = text.replace("'interpolation'\n[data]", &format!("'{config}'\n[data]"));
        fs::write(place.join(config).join("a.toml"), text).unwrap();
    }
    let reproduce = |configs: &str, out: &str| {
        format!("reproduce {configs} --data data --out {out} --runs runs")
    };
    let done = |command: &str| {
        let output = run(place, &command.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{command}: {output:?}");
    };
    refused(
        place,
        &reproduce("one", "notes"),
        "notes holds files already; --force",
    );
    done(&reproduce("one", "results"));
    done(&reproduce("one", "results"));
    refused(
        place,
        &reproduce("two", "results"),
        "tables with a row \"one\"",
    );
    done(&format!("{} --force", reproduce("two", "results")));
}

#[test]
fn scores_on_other_clips_take_the_place_of_earlier_ones_with_force_only() {
    let folder = place();
    let place = folder.path();
    let done = |command: &str| {
        let output = run(place, &command.split(' ').collect::<Vec<_>>());
        assert!(output.status.success(), "{command}: {output:?}");
        String::from_utf8(output.stderr).unwrap()
    };
    let scores = || fs::read(place.join("run/evaluation.json")).unwrap();
    let own = scores();
    fs::remove_file(place.join("run/evaluation.json")).unwrap();
    done("evaluate run --data data");
    assert_eq!(scores(), own);
    let other = "evaluate run --data data --set data.split.share=0.5 --other-data";
    assert!(done(other).contains("the run keeps its scores, and none on other data"));
    assert_eq!(scores(), own);
    done(&format!("{other} --force"));
    assert_ne!(scores(), own);

    done("evaluate interpolation.toml --data data --out scores");
    let clip = clips(place).pop().unwrap();
    fs::remove_file(clip).unwrap();
    let again = "evaluate interpolation.toml --data data --out scores";
    refused(place, again, "scores holds scores on other clips");
    done(&format!("{again} --force"));
}

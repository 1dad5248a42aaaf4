//! A run holds what it was made with: it is used from any folder, whatever becomes of the config and
//! the mapping that it began with.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::LazyLock;

use keydance::motion::skeleton::DANCE_JOINTS;
use tempfile::TempDir;

use crate::folders::copy;
use crate::generated_data::write_clips;
use crate::small_run::{digest, stderr};
use crate::trained_run::keydance;

const SMALL: &str = "name = 'small'\n[data]\nsplit = { share = 0.8 }\nmapping = '../maps/map.toml'\n\
    [model]\nkind = 'pan2021'\nhidden = 8\ncode = 8\nheads = 2\nfeed_forward = 8\nencoder_layers = 1\ndecoder_layers = 1\n\
    [schedule]\nmax_len = 6\nfraction = 0.05\nbatch_size = 8\nshards = 1\n[checkpoint]\nevery_steps = 5\n";

/// The dance skeleton mapped onto itself, `scale` times as large.
fn mapping(scale: &str) -> String {
    let joints = DANCE_JOINTS.iter().filter(|name| **name != "Spine1");
    let joints: String = joints.map(|name| format!("{name} = '{name}'\n")).collect();
    let between = "Spine1 = { between = ['Spine', 'Spine2'], at = 0.5 }";
    format!("scale = {scale}\nup = 'y'\n[joints]\n{joints}{between}\n")
}

/// Clips in `data`, a config in `configs` that names a mapping in `maps`, and its `run`.
static TRAINED: LazyLock<TempDir> = LazyLock::new(|| {
    let folder = TempDir::new().unwrap();
    for name in ["data", "configs", "maps"] {
        fs::create_dir(folder.path().join(name)).unwrap();
    }
    write_clips(&folder.path().join("data"), 60, 3);
    fs::write(folder.path().join("maps/map.toml"), mapping("1")).unwrap();
    fs::write(folder.path().join("configs/small.toml"), SMALL).unwrap();
    digest(&train(folder.path(), "", "configs/small.toml", &[]));
    folder
});

/// A copy of all that.
fn place() -> TempDir {
    let place = TempDir::new().unwrap();
    copy(TRAINED.path(), place.path());
    place
}

/// Trains into `run`; the command is given in the folder `from`.
fn train(place: &Path, from: &str, config: &str, more: &[&str]) -> Output {
    let mut command = keydance("train");
    command.arg(config).current_dir(place.join(from)).args(more);
    command.arg("--data").arg(place.join("data"));
    command.arg("--out").arg(place.join("run"));
    command.output().unwrap()
}

/// As if the training had been killed after its last checkpoint but one.
fn stop(run: &Path) {
    fs::remove_file(run.join("weights.safetensors")).unwrap();
    let checkpoints = fs::read_dir(run.join("checkpoints")).unwrap();
    let newest = checkpoints.map(|entry| entry.unwrap().path()).max();
    fs::remove_dir_all(newest.unwrap()).unwrap();
}

fn first_clip(place: &Path) -> PathBuf {
    let clips = fs::read_dir(place.join("data")).unwrap();
    clips.map(|entry| entry.unwrap().path()).min().unwrap()
}

/// What evaluating, generating and drawing with the run say, in a folder of its own.
fn uses(place: &Path) -> [Output; 3] {
    let elsewhere = TempDir::new().unwrap();
    let clip = first_clip(place);
    let evaluate = ["--lengths", "10"].map(Into::into).to_vec();
    let generate = vec![
        "--motion".into(),
        clip.into_os_string(),
        "--keyframes".into(),
    ];
    let generate = [
        generate,
        ["0,30", "--out", "new.bvh"].map(Into::into).to_vec(),
    ]
    .concat();
    let figures = ["--length", "20", "--out", "figures"]
        .map(Into::into)
        .to_vec();
    let data = vec!["--data".into(), place.join("data").into_os_string()];
    [
        ("evaluate", [data.clone(), evaluate].concat()),
        ("generate", generate),
        ("figures", [data, figures].concat()),
    ]
    .map(|(name, arguments)| {
        let mut command = keydance(name);
        command.arg(place.join("run")).args(arguments);
        command.current_dir(elsewhere.path()).output().unwrap()
    })
}

#[test]
fn a_run_with_a_mapping_is_used_from_any_folder_when_the_mapping_is_gone() {
    let folder = place();
    fs::remove_dir_all(folder.path().join("maps")).unwrap();
    for output in uses(folder.path()) {
        assert!(output.status.success(), "{}", stderr(&output));
    }
    // The run's own config is enough to go on.
    let whole = digest(&train(
        TRAINED.path(),
        "",
        "configs/small.toml",
        &["--resume"],
    ));
    stop(&folder.path().join("run"));
    let resumed = train(folder.path(), "", "run/config.toml", &["--resume"]);
    assert_eq!(digest(&resumed), whole);
}

#[test]
fn a_training_goes_on_by_what_the_mapping_says_wherever_it_lies() {
    let folder = place();
    let (place, run) = (folder.path(), folder.path().join("run"));
    let whole = digest(&train(
        TRAINED.path(),
        "",
        "configs/small.toml",
        &["--resume"],
    ));
    stop(&run);
    fs::write(place.join("other.toml"), mapping("3")).unwrap();
    let refused = |from: &str, more: &[&str], message: &str| {
        let config = place.join("configs/small.toml");
        let output = train(
            place,
            from,
            config.to_str().unwrap(),
            &[more, &["--resume"]].concat(),
        );
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains(message), "{}", stderr(&output));
    };
    let other = ["--set", "data.mapping=other.toml"];
    refused("", &other, "data.mapping.scale: 1.0, 3.0");
    refused(
        "data",
        &other,
        "--set data.mapping=other.toml: data.mapping: other.toml cannot be read",
    );
    fs::write(place.join("other.toml"), mapping("1.0")).unwrap();
    fs::write(place.join("maps/map.toml"), mapping("3")).unwrap();
    refused("", &[], "data.mapping.scale: 1.0, 3.0");
    // In another file, of another name, given on the command line: the same mapping.
    let config = "configs/small.toml";
    let resumed = train(place, "", config, &[&other[..], &["--resume"]].concat());
    assert_eq!(digest(&resumed), whole);
    fs::remove_file(place.join("maps/map.toml")).unwrap();
    refused("", &[], "map.toml cannot be read: No such file");
}

#[test]
fn a_run_whose_config_was_edited_by_hand_is_refused_with_both_values() {
    let folder = place();
    let config = folder.path().join("run/config.toml");
    let text = fs::read_to_string(&config).unwrap();
    for (before, after, message) in [
        ("share = 0.8", "share = 0.3", "data.split.share: 0.8, 0.3"),
        ("fps = 30.0", "fps = 15.0", "data.fps: 30.0, 15.0"),
        ("scale = 1.0", "scale = 2.0", "data.mapping.scale: 1.0, 2.0"),
        (
            "Head = \"Head\"",
            "Head = \"Neck\"",
            "data.mapping.joints.Head: \"Head\", \"Neck\"",
        ),
        ("seed = 1\n", "seed = 2\n", "seed: 1, 2"),
        (
            "batch_size = 8",
            "batch_size = 9",
            "schedule.batch_size: 8, 9",
        ),
        (
            "beta1 = 0.9\n",
            "beta1 = 0.8\n",
            "optimiser.beta1: 0.9, 0.8",
        ),
    ] {
        assert!(text.contains(before), "{before}: {text}");
        fs::write(&config, text.replace(before, after)).unwrap();
        for output in uses(folder.path()) {
            assert_eq!(output.status.code(), Some(1));
            let said = stderr(&output);
            assert!(
                said.contains("was edited since") && said.contains(message),
                "{said}"
            );
        }
    }
    // A path in place of the content counts from the run's folder, as of runs of before.
    let (before, after) = text.split_once("[data.mapping]").unwrap();
    let after = &after[after.find("\n[model").unwrap()..];
    let path = before.replace("[data]\n", "[data]\nmapping = \"map.toml\"\n");
    fs::write(&config, format!("{path}{after}")).unwrap();
    for output in uses(folder.path()) {
        let said = stderr(&output);
        assert!(
            said.contains("put the mapping file that it was made with there"),
            "{said}"
        );
    }
    fs::write(folder.path().join("run/map.toml"), mapping("1.0")).unwrap();
    for output in uses(folder.path()) {
        assert!(output.status.success(), "{}", stderr(&output));
    }
}

#[test]
fn a_run_does_not_generate_at_another_rate() {
    let folder = place();
    let mut command = keydance("generate");
    command
        .arg(folder.path().join("run"))
        .arg("--motion")
        .arg(first_clip(folder.path()));
    command.args(["--keyframes", "0,20", "--set", "data.fps=15", "--out"]);
    let output = command.arg(folder.path().join("new.bvh")).output().unwrap();
    assert!(
        stderr(&output).contains("data.fps: 30.0, 15.0"),
        "{}",
        stderr(&output)
    );
    assert!(!folder.path().join("new.bvh").exists());
}

//! `keydance evaluate` and `keydance tables` through the binary.

use std::collections::HashMap;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, TensorView};
use serde_json::Value;
use tempfile::TempDir;

use crate::generated_data::write_clips;
use crate::real_data;
use crate::trained_run::{TrainedRun, keydance};

const WEIGHTS: &str = "weights.safetensors";

static FIXTURE: LazyLock<TrainedRun> = LazyLock::new(TrainedRun::new);

/// `keydance evaluate SUBJECT` on the fixture's data.
fn evaluate(subject: &Path) -> Command {
    let mut command = keydance("evaluate");
    command.arg(subject).arg("--data").arg(FIXTURE.path("data"));
    command
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// A copy of the trained run without its scores.
fn copied_run() -> TempDir {
    let copy = TempDir::new().unwrap();
    for name in ["config.toml", "manifest.json", WEIGHTS] {
        fs::copy(FIXTURE.path("run").join(name), copy.path().join(name)).unwrap();
    }
    copy
}

#[test]
fn the_json_has_every_score_at_every_length_and_their_averages() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("scores.json");
    evaluate(&FIXTURE.path("interpolation.toml"))
        .arg("--json")
        .arg(&file)
        .assert()
        .success()
        .stdout(contains("LRP (cm)").and(contains("2 test clips, 360 frames")));
    let both = json(&file);
    let scores = &both["equations"];
    let keys = |value: &Value| -> Vec<String> {
        let mut keys: Vec<String> = value.as_object().unwrap().keys().cloned().collect();
        keys.sort_unstable();
        keys
    };
    assert_eq!(keys(&both), ["equations", "published"]);
    assert_eq!(keys(scores), ["art", "avf", "foot_skate", "lrp", "windows"]);
    assert_eq!(keys(&both["published"]), ["art", "avf", "lrp", "windows"]);
    assert_eq!(keys(&scores["windows"]), ["10", "100", "150", "50"]);
    // Starts every ceil(0.1 (N + 1)) frames in two clips of 180.
    for (length, windows) in [
        ("10", 2 * 85),
        ("50", 2 * 22),
        ("100", 2 * 8),
        ("150", 2 * 2),
    ] {
        assert_eq!(scores["windows"][length], windows, "N = {length}");
    }
    for name in ["lrp", "avf", "art", "foot_skate"] {
        let score = &scores[name];
        assert_eq!(keys(score), ["10", "100", "150", "50", "avg"]);
        let of = |key: &str| score[key].as_f64().unwrap();
        let mean = (of("10") + of("50") + of("100") + of("150")) / 4.0;
        assert!((of("avg") - mean).abs() < 1e-9, "{name}");
    }
    assert_eq!(scores["art"]["avg"], 1.0);
}

#[test]
fn exports_are_scored_by_name_only_and_their_pinned_toes_stay_on_the_floor() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("scores.json");
    evaluate(&FIXTURE.path("interpolation.toml"))
        .args(["--protocol", "exports", "--lengths", "40", "--windows", "4"])
        .arg("--json")
        .arg(&file)
        .assert()
        .success()
        .stdout(contains("foot skate, pinned").and(contains("into the floor")));
    let scores = &json(&file)["exports"];
    let score = |metric: &str| scores[metric]["40"].as_f64().unwrap();
    assert_eq!(scores["windows"]["40"], 4);
    assert!(score("foot_skate_pinned") < score("foot_skate"));
    assert!(score("into_floor") > 0.1 && score("into_floor_pinned") < 1e-6);
    assert!(score("jerk_pinned") > 0.0 && score("jerk_recorded") > 0.0);
}

#[test]
fn a_run_gets_its_scores_and_any_number_of_threads_gives_the_same() {
    let run = copied_run();
    let out = TempDir::new().unwrap();
    let file = |threads: &str| {
        let file = out.path().join(threads);
        evaluate(run.path())
            .args(["--threads", threads, "--json"])
            .arg(&file)
            .assert()
            .success();
        fs::read(file).unwrap()
    };
    let scores = file("1");
    assert_eq!(scores, file("3"));
    assert_eq!(
        scores,
        fs::read(run.path().join("evaluation.json")).unwrap()
    );
}

#[test]
fn a_run_that_is_not_finished_is_evaluated_with_its_newest_checkpoint() {
    let run = copied_run();
    evaluate(run.path()).assert().success();
    let finished = json(&run.path().join("evaluation.json"));
    let newest = fs::read_dir(FIXTURE.path("run/checkpoints"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .max()
        .unwrap();
    let folder = run
        .path()
        .join("checkpoints")
        .join(newest.file_name().unwrap());
    fs::create_dir_all(&folder).unwrap();
    fs::rename(run.path().join(WEIGHTS), folder.join(WEIGHTS)).unwrap();
    evaluate(run.path())
        .assert()
        .success()
        .stdout(contains("step-"));
    assert_eq!(json(&run.path().join("evaluation.json")), finished);
    fs::remove_dir_all(run.path().join("checkpoints")).unwrap();
    evaluate(run.path())
        .assert()
        .failure()
        .stderr(contains("holds no weights").and(contains("keydance train")));
}

/// Rewrites a run's weights: `change` gets names with shapes and values.
fn change_weights(run: &Path, change: impl Fn(&mut HashMap<String, (Vec<usize>, Vec<u8>)>)) {
    let path = run.join(WEIGHTS);
    let content = fs::read(&path).unwrap();
    let (_, header) = SafeTensors::read_metadata(&content).unwrap();
    let mut tensors: HashMap<String, (Vec<usize>, Vec<u8>)> = SafeTensors::deserialize(&content)
        .unwrap()
        .iter()
        .map(|(name, view)| (name.into(), (view.shape().to_vec(), view.data().to_vec())))
        .collect();
    change(&mut tensors);
    let views = tensors.iter().map(|(name, (shape, data))| {
        (
            name,
            TensorView::new(Dtype::F32, shape.clone(), data).unwrap(),
        )
    });
    let changed = safetensors::serialize(views, header.metadata().clone()).unwrap();
    fs::write(path, changed).unwrap();
    forget_the_weights_digest(run);
}

/// As in a run of a version that did not keep it.
fn forget_the_weights_digest(run: &Path) {
    let path = run.join("manifest.json");
    let mut manifest = json(&path);
    let digest = manifest
        .as_object_mut()
        .unwrap()
        .remove("weights_file_digest");
    assert!(digest.is_some());
    fs::write(path, manifest.to_string()).unwrap();
}

#[test]
fn weights_that_are_not_those_of_the_trainings_end_are_refused() {
    let run = copied_run();
    let path = run.path().join(WEIGHTS);
    let mut weights = fs::read(&path).unwrap();
    let last = weights.len() - 1;
    weights[last] ^= 1;
    fs::write(&path, &weights).unwrap();
    let says = "is not the file with which the training in";
    evaluate(run.path())
        .assert()
        .failure()
        .stderr(contains(says));
    forget_the_weights_digest(run.path());
    evaluate(run.path()).assert().success();
}

#[test]
fn scores_of_other_weights_than_the_runs_are_not_taken_for_its_own() {
    let run = copied_run();
    evaluate(run.path()).assert().success();
    let path = run.path().join("evaluation_data.json");
    let mut data = json(&path);
    let digest = json(&run.path().join("manifest.json"))["weights_file_digest"].clone();
    assert_eq!(data["weights"], digest);
    data["weights"] = "of a checkpoint".into();
    fs::write(path, data.to_string()).unwrap();
    let says = contains("are scores of other weights than the training ended with");
    let tables = || {
        let mut command = keydance("tables");
        command
            .arg(run.path())
            .arg("--out")
            .arg(run.path().join("tables.md"));
        command.assert()
    };
    tables().failure().stderr(says.clone());
    keydance("runs").arg(run.path()).assert().stdout(says);
    evaluate(run.path()).assert().success();
    tables().success();
}

#[test]
fn a_key_that_acts_after_the_network_is_not_edited_in_a_runs_config_either() {
    let run = copied_run();
    let path = run.path().join("config.toml");
    let config = fs::read_to_string(&path).unwrap();
    let edited = config.replace("velocity_refinement = false", "velocity_refinement = true");
    assert_ne!(edited, config);
    fs::write(path, edited).unwrap();
    evaluate(run.path())
        .assert()
        .failure()
        .stderr(contains("was edited since").and(contains("model.velocity_refinement")));
}

#[test]
fn a_run_without_its_manifest_is_used_on_data_only_with_consent() {
    let run = copied_run();
    fs::remove_file(run.path().join("manifest.json")).unwrap();
    evaluate(run.path())
        .assert()
        .failure()
        .stderr(contains("has no manifest.json"));
    evaluate(run.path()).arg("--other-data").assert().success();
}

#[test]
fn the_statistics_are_those_of_the_weights_file() {
    let run = copied_run();
    let lrp = || {
        json(&run.path().join("evaluation.json"))["equations"]["lrp"]["avg"]
            .as_f64()
            .unwrap()
    };
    evaluate(run.path()).assert().success();
    let before = lrp();
    change_weights(run.path(), |tensors| {
        let mean = &mut tensors.get_mut("feature_mean").unwrap().1;
        // p^b's first number, 500 cm off.
        mean[..4].copy_from_slice(&500f32.to_le_bytes());
    });
    evaluate(run.path()).assert().success();
    assert!(lrp() > before + 300.0, "{} from {before}", lrp());
}

#[test]
fn damaged_weights_are_errors_that_name_the_file_and_what_is_wrong() {
    let fails = |run: &TempDir, words: &[&str]| {
        let mut assert = evaluate(run.path()).assert().failure().code(1);
        for word in [WEIGHTS].iter().chain(words) {
            assert = assert.stderr(contains(*word));
        }
        assert.stderr(contains("panicked").not());
        assert!(!run.path().join("evaluation.json").exists());
    };
    let whole = fs::read(FIXTURE.path("run").join(WEIGHTS)).unwrap();
    let hostile_header = [&u64::MAX.to_le_bytes()[..], b"{}"].concat();
    for content in [&whole[..whole.len() / 2], &whole[..4], &[], &hostile_header] {
        let run = copied_run();
        fs::write(run.path().join(WEIGHTS), content).unwrap();
        fails(&run, &["not a whole safetensors file"]);
    }
    let run = copied_run();
    change_weights(run.path(), |tensors| {
        tensors.remove("lstm1.bias_hh_l0");
    });
    fails(&run, &["has no lstm1.bias_hh_l0 [32]"]);
    let run = copied_run();
    change_weights(run.path(), |tensors| {
        let copy = tensors["lstm1.bias_hh_l0"].clone();
        tensors.insert("lstm3.bias_hh_l0".into(), copy);
    });
    fails(&run, &["has lstm3.bias_hh_l0 [32]"]);
    let run = copied_run();
    change_weights(run.path(), |tensors| {
        tensors.get_mut("lstm1.bias_hh_l0").unwrap().0 = vec![4, 8];
    });
    fails(&run, &["lstm1.bias_hh_l0 is [4, 8]", "[32] in the model"]);
    let run = copied_run();
    change_weights(run.path(), |tensors| {
        let bias = &mut tensors.get_mut("state_decoder.4.bias").unwrap().1;
        bias[..4].copy_from_slice(&f32::NAN.to_le_bytes());
    });
    let mut nan = evaluate(run.path());
    nan.assert().failure().stderr(contains("NaN"));
}

#[test]
fn a_model_and_weights_of_another_are_refused_with_both_values() {
    evaluate(&FIXTURE.path("run"))
        .args(["--set", "model.heads=4"])
        .assert()
        .failure()
        .stderr(contains("model.heads: 2, 4").and(contains(WEIGHTS)));
}

#[test]
fn data_that_the_run_was_not_trained_on_need_consent() {
    let data = TempDir::new().unwrap();
    write_clips(data.path(), 160, 4);
    let run = copied_run();
    let on_other = || {
        let mut command = keydance("evaluate");
        command.arg(run.path()).arg("--data").arg(data.path());
        command
    };
    let digest = json(&run.path().join("manifest.json"))["data_digest"]
        .as_str()
        .unwrap()
        .to_string();
    on_other()
        .assert()
        .failure()
        .stderr(contains(digest).and(contains("--other-data")));
    let keeps = contains("none on other data than its own");
    let output = on_other().arg("--other-data").assert().success();
    output.stderr(keeps);
    assert!(!run.path().join("evaluation.json").exists());
    on_other()
        .args(["--other-data", "--force"])
        .assert()
        .success();
    assert!(run.path().join("evaluation.json").exists());
}

#[test]
fn a_clip_shorter_than_a_window_is_named() {
    let data = TempDir::new().unwrap();
    write_clips(data.path(), 180, 3);
    let other = TempDir::new().unwrap();
    write_clips(other.path(), 120, 3);
    // The last in the order of the split: a test clip.
    let name = fs::read_dir(data.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .find(|found| found.starts_with("choreography_005"))
        .unwrap();
    fs::copy(other.path().join(&name), data.path().join(&name)).unwrap();
    keydance("evaluate")
        .arg(FIXTURE.path("interpolation.toml"))
        .arg("--data")
        .arg(data.path())
        .assert()
        .success()
        .stderr(contains(format!("warning: {name} has 120 frames")).and(contains("N = 150")));
}

#[test]
fn what_is_no_evaluable_model_is_an_error_that_says_what_to_do() {
    let empty = TempDir::new().unwrap();
    evaluate(empty.path())
        .assert()
        .failure()
        .stderr(contains("not a run's folder").and(contains("config.toml")));
    evaluate(&FIXTURE.path("small.toml"))
        .assert()
        .failure()
        .stderr(contains("is trained").and(contains("keydance train")));
    evaluate(&FIXTURE.path("missing.toml"))
        .assert()
        .failure()
        .stderr(contains("missing.toml"));
    evaluate(&FIXTURE.path("run"))
        .arg("--out")
        .arg(empty.path())
        .assert()
        .failure()
        .stderr(contains("--out is for a config"));
    evaluate(&FIXTURE.path("interpolation.toml"))
        .args(["--set", "data.split='dance'"])
        .assert()
        .failure()
        .stderr(contains("123 clips").and(contains("holds 6")));
}

#[test]
fn scores_are_not_written_over_those_of_another_config() {
    let out = TempDir::new().unwrap();
    let to_out = || {
        let mut command = evaluate(&FIXTURE.path("interpolation.toml"));
        command.arg("--out").arg(out.path());
        command
    };
    to_out().assert().success();
    to_out().assert().success();
    to_out()
        .args(["--set", "seed=7"])
        .assert()
        .failure()
        .stderr(contains("seed: 1, 7"));
}

#[test]
fn tables_set_runs_beside_the_paper_and_say_their_budget() {
    let out = TempDir::new().unwrap();
    let interpolation = out.path().join("interpolation");
    evaluate(&FIXTURE.path("interpolation.toml"))
        .arg("--out")
        .arg(&interpolation)
        .assert()
        .success();
    let run = copied_run();
    let tables = out.path().join("tables.md");
    let make = || {
        let mut command = keydance("tables");
        command.args([&interpolation, &run.path().to_path_buf()]);
        command.arg("--out").arg(&tables);
        command
    };
    make()
        .assert()
        .failure()
        .stderr(contains("keydance evaluate").and(contains(run.path().to_str().unwrap())));
    assert!(!tables.exists());
    evaluate(run.path()).assert().success();
    make().assert().success();
    let text = fs::read_to_string(&tables).unwrap();
    let manifest = json(&run.path().join("manifest.json"));
    let digest = manifest["data_digest"].as_str().unwrap();
    for words in [
        "## Table 2: LRP",
        "## foot skate by `equations`",
        "needs no training",
        "schedule.fraction 0.05",
        "seed 1",
        digest,
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let lrp = json(&interpolation.join("evaluation.json"))["published"]["lrp"]["150"]
        .as_f64()
        .unwrap();
    let difference = format!("{:+.2}", lrp - 124.47);
    assert!(text.contains(&difference), "{difference}: {text}");
    assert!(!text.contains("windows of each length"), "{text}");
    fs::write(run.path().join("evaluation.json"), "{}").unwrap();
    let emptied = make().arg("--force").assert().failure();
    emptied.stderr(contains("holds no scores; to get some"));
    assert_eq!(fs::read_to_string(&tables).unwrap(), text);
}

#[test]
fn tables_say_where_only_a_part_of_the_windows_was_scored() {
    let out = TempDir::new().unwrap();
    let (scores, tables) = (out.path().join("scores"), out.path().join("tables.md"));
    for (most, said) in [("3", true), ("9999", false)] {
        let mut command = evaluate(&FIXTURE.path("interpolation.toml"));
        command.args(["--windows", most, "--out"]).arg(&scores);
        command.assert().success();
        let mut command = keydance("tables");
        command
            .arg(&scores)
            .arg("--force")
            .arg("--out")
            .arg(&tables);
        command.assert().success();
        let text = fs::read_to_string(&tables).unwrap();
        let words = "Ours on at most 3 windows of each length of 2 test clips";
        assert_eq!(text.contains(words), said, "{text}");
    }
}

#[test]
fn scores_of_different_data_are_not_set_side_by_side() {
    let out = TempDir::new().unwrap();
    let data = out.path().join("data");
    fs::create_dir(&data).unwrap();
    write_clips(&data, 160, 4);
    let scored = |data: &Path, name: &str| {
        let folder = out.path().join(name);
        keydance("evaluate")
            .arg(FIXTURE.path("interpolation.toml"))
            .arg("--data")
            .arg(data)
            .arg("--out")
            .arg(&folder)
            .assert()
            .success();
        folder
    };
    keydance("tables")
        .args([scored(&FIXTURE.path("data"), "a"), scored(&data, "b")])
        .arg("--out")
        .arg(out.path().join("tables.md"))
        .assert()
        .failure()
        .stderr(contains("360 frames").and(contains("320 frames")));
}

#[test]
fn clips_other_than_the_test_clips_are_named_in_the_json_and_have_files_of_their_own() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("scores.json");
    let scored = |clips: &str, share: &str| {
        let mut command = evaluate(&FIXTURE.path("interpolation.toml"));
        command.args(["--clips", clips, "--set"]);
        command.arg(format!("data.validation_share={share}"));
        command.arg("--out").arg(out.path().join("scores"));
        command.arg("--force").arg("--json").arg(&file);
        command
    };
    let of_validation = scored("validation", "0.25").assert().success();
    of_validation.stdout(contains("on 1 validation clip, 180 frames"));
    let scores = json(&file);
    assert_eq!(scores["clips"], "validation");
    assert!(scores["equations"]["lrp"]["avg"].is_number());
    let folder = out.path().join("scores");
    assert_eq!(json(&folder.join("evaluation_validation.json")), scores);
    let data = json(&folder.join("evaluation_validation_data.json"));
    assert_eq!(
        (&data["part"], &data["clips"]),
        (&"validation".into(), &1.into())
    );
    // There are no scores on test clips for the tables, nor do they take others under that name.
    let tables = || {
        let mut command = keydance("tables");
        command.arg(&folder);
        command.arg("--out").arg(out.path().join("tables.md"));
        command
    };
    let no_scores = tables().assert().failure();
    no_scores.stderr(contains("has no evaluation.json"));
    for name in ["evaluation", "evaluation_data"] {
        let from = name.replace("evaluation", "evaluation_validation");
        let renamed = folder.join(format!("{name}.json"));
        fs::copy(folder.join(format!("{from}.json")), renamed).unwrap();
    }
    tables().assert().failure().stderr(contains("test clips"));
    scored("train", "0.25")
        .assert()
        .success()
        .stdout(contains("on 3 training clips, 540 frames"));
    scored("validation", "0")
        .assert()
        .failure()
        .stderr(contains("data.validation_share").and(contains("no validation clips")));
}

#[test]
fn lengths_of_ones_own_are_scored_each_once() {
    let out = TempDir::new().unwrap();
    let file = out.path().join("scores.json");
    evaluate(&FIXTURE.path("interpolation.toml"))
        .args(["--lengths", "30,5,30", "--json"])
        .arg(&file)
        .assert()
        .success();
    let scores = &json(&file)["equations"];
    let lengths: Vec<&String> = scores["windows"].as_object().unwrap().keys().collect();
    assert_eq!(lengths.len(), 2);
    let lrp = |key: &str| scores["lrp"][key].as_f64().unwrap();
    assert!((lrp("avg") - (lrp("5") + lrp("30")) / 2.0).abs() < 1e-12);
    evaluate(&FIXTURE.path("interpolation.toml"))
        .args(["--lengths", "0"])
        .assert()
        .failure()
        .stderr(contains("--lengths"));
}

#[test]
fn a_cheap_evaluation_says_so_and_leaves_a_runs_scores_alone() {
    let run = copied_run();
    let file = run.path().join("cheap.json");
    let cheap = |options: &[&str]| {
        let mut command = evaluate(run.path());
        command.args(options).arg("--json").arg(&file);
        command.assert()
    };
    let said = contains("at most 3 windows of each length").and(contains("By `equations`").not());
    let options = [
        "--windows",
        "3",
        "--lengths",
        "10,50",
        "--protocol",
        "published",
    ];
    cheap(&options).success().stdout(said);
    let windows = &json(&file)["published"]["windows"];
    assert_eq!((&windows["10"], &windows["50"]), (&3.into(), &3.into()));
    assert!(!run.path().join("evaluation.json").exists());
    let unknown = cheap(&["--force", "--protocol", "mine"]).failure();
    unknown.stderr(contains("--protocol mine").and(contains("equations, published")));
}

#[test]
fn a_run_is_scored_with_its_predictions_refined_too_and_keeps_only_the_scores_of_its_own_model() {
    let run = copied_run();
    let scored = |refined: bool| {
        let file = run.path().join(format!("{refined}.json"));
        let option = format!("model.velocity_refinement={refined}");
        let mut command = evaluate(run.path());
        command.args(["--set", &option, "--json"]).arg(&file);
        command.assert().success();
        json(&file)
    };
    let kept = run.path().join("evaluation.json");
    let refined = scored(true);
    assert!(!kept.exists());
    let plain = scored(false);
    assert_eq!(json(&kept), plain);
    let share = |scores: &Value| scores["equations"]["avf"]["avg"].as_f64().unwrap();
    assert!(share(&refined) > share(&plain), "{refined} {plain}");
    evaluate(run.path())
        .args(["--set", "model.heads=1"])
        .assert()
        .failure()
        .stderr(contains("model.heads"));
}

#[test]
fn clips_that_a_run_was_trained_on_are_not_set_aside_afterwards_without_consent() {
    let run = copied_run();
    let asked = || {
        let mut command = evaluate(run.path());
        command.args(["--clips", "validation"]);
        command.args(["--set", "data.validation_share=0.25"]);
        command
    };
    let refused = asked().assert().failure();
    refused
        .stderr(contains("data.validation_share: 0.0, 0.25").and(contains("its training clips")));
    asked().arg("--other-data").assert().success();
}

#[test]
fn interpolation_on_the_dance_data_has_the_known_scores() {
    let Some(data) = real_data::dance_folder() else {
        return;
    };
    let out = TempDir::new().unwrap();
    let file = out.path().join("scores.json");
    let config =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/pan2021/interpolation.toml");
    keydance("evaluate")
        .arg(config)
        .arg("--data")
        .arg(data)
        .arg("--json")
        .arg(&file)
        .assert()
        .success();
    let scores = json(&file);
    let lrp = |protocol: &str, length: &str| scores[protocol]["lrp"][length].as_f64().unwrap();
    for (length, known) in [("10", 22.8508), ("50", 95.8121)] {
        let found = lrp("equations", length);
        assert!((found - known).abs() < 1e-4, "N = {length}: {found}");
    }
    // By another implementation, printed to a hundredth.
    for (length, known) in [
        ("10", 17.80),
        ("50", 93.11),
        ("100", 115.26),
        ("150", 123.29),
    ] {
        let found = lrp("published", length);
        assert!((found - known).abs() < 5e-3, "N = {length}: {found}");
    }
}

/// The lines that `keydance runs` prints, cells parted by two blanks or more.
fn runs(folder: &Path) -> Vec<Vec<String>> {
    let output = keydance("runs").arg(folder).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    let cells = |line: &str| line.split("  ").map(str::trim).map(String::from).collect();
    text.lines()
        .map(|line| {
            let all: Vec<String> = cells(line);
            all.into_iter().filter(|cell| !cell.is_empty()).collect()
        })
        .collect()
}

#[test]
fn runs_are_listed_with_state_progress_speed_scores_and_version() {
    let folder = TempDir::new().unwrap();
    let place = |name: &str| folder.path().join(name);
    let run = copied_run();
    evaluate(run.path()).assert().success();
    for (name, files) in [
        (
            "b/evaluated",
            &[
                "config.toml",
                "manifest.json",
                WEIGHTS,
                "evaluation.json",
                "evaluation_data.json",
            ][..],
        ),
        ("a", &["config.toml", "manifest.json"]),
        ("not_begun", &["config.toml"]),
        ("damaged_manifest", &["config.toml"]),
        ("damaged_scores", &["config.toml", "manifest.json", WEIGHTS]),
    ] {
        fs::create_dir_all(place(name)).unwrap();
        for file in files {
            fs::copy(run.path().join(file), place(name).join(file)).unwrap();
        }
    }
    fs::write(
        place("damaged_manifest").join("manifest.json"),
        "{\"name\": 3}",
    )
    .unwrap();
    fs::write(place("damaged_scores").join("evaluation.json"), "[]").unwrap();
    evaluate(&FIXTURE.path("interpolation.toml"))
        .arg("--out")
        .arg(place("interpolation"))
        .assert()
        .success();
    // What is no run.
    fs::create_dir_all(place("photographs/old")).unwrap();
    fs::write(place("photographs/notes.txt"), "no run").unwrap();
    fs::copy(FIXTURE.path("small.toml"), place("experiment.toml")).unwrap();

    let lines = runs(folder.path());
    let first: Vec<&str> = lines.iter().map(|cells| cells[0].as_str()).collect();
    assert_eq!(
        first[..7],
        [
            "run",
            "a",
            "b/evaluated",
            "damaged_manifest",
            "damaged_scores",
            "interpolation",
            "not_begun"
        ]
    );
    let manifest = json(&run.path().join("manifest.json"));
    let steps = format!("{0}/{0}", manifest["steps"]);
    let scores = json(&run.path().join("evaluation.json"));
    let lrp = |length: &str| {
        format!(
            "{:.1}",
            scores["equations"]["lrp"][length].as_f64().unwrap()
        )
    };
    let evaluated = &lines[2];
    assert_eq!(evaluated[1..5], ["small", "finished", &steps, "100"]);
    assert!(evaluated[6].parse::<f64>().unwrap() > 0.0, "{evaluated:?}");
    assert_eq!(evaluated[7..11], ["10", "50", "100", "150"].map(lrp));
    assert!(evaluated[11].starts_with(env!("CARGO_PKG_VERSION")));
    assert_eq!(lines[1][2], "finished, no weights");
    assert_eq!(lines[1].len(), 8);
    assert_eq!(lines[3][1], "damaged");
    assert_eq!(lines[4][2], "finished");
    assert_eq!(lines[5][1..3], ["interpolation", "needs no training"]);
    assert_eq!(lines[5].len(), 8);
    assert_eq!(lines[6][1..], ["small", "not begun"]);
    // What is wrong is said below.
    assert!(first[7].starts_with("damaged_manifest: ") && first[7].contains("is not a manifest"));
    assert!(first[8].starts_with("damaged_scores: ") && first[8].contains("holds no scores"));

    // A run's folder alone; then folders without any.
    assert_eq!(runs(&place("b/evaluated"))[1][1..3], ["small", "finished"]);
    for (folder, words) in [
        (place("photographs"), "holds no run"),
        (place("nowhere"), "cannot be read"),
    ] {
        keydance("runs")
            .arg(folder)
            .assert()
            .failure()
            .code(1)
            .stderr(contains(words));
    }
}

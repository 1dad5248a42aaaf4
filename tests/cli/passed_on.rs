//! What leaves a run: curves, event files, a packed run; and the runs that come with the program.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use keydance::autograd::Parameters;
use keydance::models::Statistics;
use keydance::models::weights::{SavedWeights, to_safetensors};
use keydance::motion::bvh;
use ndarray::{Array1, ArrayD};
use predicates::prelude::PredicateBooleanExt as _;
use predicates::str::contains;
use roxmltree::Document;

use crate::song::FIXTURE;
use crate::trained_run::{TrainedRun, keydance};

fn is_figure(file: &Path, words: &[&str]) {
    let text = fs::read_to_string(file).unwrap();
    Document::parse(&text).unwrap();
    for word in words {
        assert!(text.contains(word), "{}: {word}", file.display());
    }
}

#[test]
fn a_training_draws_its_curves_and_plot_sets_those_of_several_side_by_side() {
    let run = TrainedRun::new();
    for curve in ["loss_curve.svg", "learning_rate.svg"] {
        is_figure(&run.path("run").join(curve), &["small", "frame-steps"]);
    }
    let mut other = keydance("train");
    other
        .arg(run.path("small.toml"))
        .arg("--data")
        .arg(run.path("data"));
    other
        .args(["--set", "seed=2", "--out"])
        .arg(run.path("other"));
    other.assert().success();
    let mut plot = keydance("plot");
    plot.args(["run", "other"].map(|name| run.path(name)));
    plot.arg("--out")
        .arg(run.path("curves"))
        .arg("--tensorboard")
        .arg(run.path("events"));
    plot.assert().success().stdout(contains("loss_curve.svg"));
    is_figure(
        &run.path("curves/loss_curve.svg"),
        &["2 trainings", ">run<", ">other<"],
    );
    let log = fs::read_to_string(run.path("other/log.jsonl")).unwrap();
    let events = fs::read(run.path("events/other/events.out.tfevents.0.keydance")).unwrap();
    let (mut rest, mut records) = (&events[..], Vec::new());
    while !rest.is_empty() {
        let length = u64::from_le_bytes(rest[..8].try_into().unwrap()) as usize;
        records.push(&rest[12..12 + length]);
        rest = &rest[16 + length..];
    }
    assert_eq!(records.len(), log.lines().count() + 1);
    assert!(records[0].ends_with(b"brain.Event:2"));
    let tag = b"loss/total";
    assert!(records[1].windows(tag.len()).any(|window| window == tag));
    let mut none = keydance("plot");
    none.arg(run.path("data"))
        .arg("--out")
        .arg(run.path("none"));
    none.assert().failure().stderr(contains("panicked").not());
    assert!(!run.path("none").exists());
}

#[test]
fn a_packed_run_is_half_as_large_and_dances_alike() {
    let run = TrainedRun::new();
    let packed = run.path("packed");
    let pack = || {
        let mut pack = keydance("pack");
        pack.arg(run.path("run")).arg("--out").arg(&packed);
        pack
    };
    pack().assert().success();
    pack().assert().failure().stderr(contains("--force"));
    pack().arg("--force").assert().success();
    // A run that a training wrote is no place for it, its own least of all.
    let weights = run.path("run/weights.safetensors");
    let before = fs::read(&weights).unwrap();
    let mut onto_itself = keydance("pack");
    onto_itself
        .arg(&packed)
        .arg("--out")
        .arg(run.path("run"))
        .arg("--force");
    onto_itself
        .assert()
        .failure()
        .stderr(contains("would be lost"));
    assert_eq!(fs::read(&weights).unwrap(), before);
    let mut resumed = keydance("train");
    resumed
        .arg(run.path("small.toml"))
        .arg("--data")
        .arg(run.path("data"));
    resumed.arg("--resume").arg("--out").arg(&packed);
    resumed
        .assert()
        .failure()
        .stderr(contains("as a packed run does"));
    let dance = |from: &Path, name: &str| {
        let clips = fs::read_dir(run.path("data")).unwrap();
        let mut clips: Vec<_> = clips.map(|clip| clip.unwrap().path()).collect();
        clips.sort();
        let out = run.path(name);
        let mut generate = keydance("generate");
        generate.arg(from).arg("--motion").arg(&clips[0]);
        generate.args(["--keyframes", "20,50", "--out"]).arg(&out);
        generate.assert().success();
        let clip = bvh::read(&out).unwrap().to_clip();
        clip.skeleton.world_positions(&clip.poses)
    };
    let (own, passed_on) = (dance(&run.path("run"), "a.bvh"), dance(&packed, "b.bvh"));
    for (a, b) in own.iter().flatten().zip(passed_on.iter().flatten()) {
        assert!(a.distance(*b) < 0.5, "{a} {b}");
    }
    let mut evaluate = keydance("evaluate");
    evaluate.arg(&packed).arg("--data").arg(run.path("data"));
    evaluate.assert().success();
}

#[test]
fn large_arrays_are_rounded_to_half_precision_and_small_ones_kept() {
    let large: Array1<f64> = (0..2000).map(|it| 0.37 * f64::from(it) - 11.3).collect();
    let small: Array1<f64> = (0..1000).map(|it| 1.0 / (1.0 + f64::from(it))).collect();
    let saved = |large: &Array1<f64>| {
        let statistics = Statistics::default().with("large", large.clone().into_dyn());
        let statistics = statistics.with("small", small.clone().into_dyn());
        let bytes = to_safetensors(&Parameters::new(), &statistics, "").unwrap();
        SavedWeights::parse(&bytes, Path::new("w")).unwrap()
    };
    let half = saved(&large).to_half().unwrap();
    let half = SavedWeights::parse(&half, Path::new("half")).unwrap();
    let read = |name: &str, len: usize| -> ArrayD<f64> { half.statistic(name, &[len]).unwrap() };
    for (found, wanted) in read("large", 2000).iter().zip(&large) {
        assert!(
            (found - wanted).abs() <= wanted.abs() / 2048.0 + 1e-7,
            "{found} {wanted}"
        );
    }
    for (found, wanted) in read("small", 1000).iter().zip(&small) {
        assert_eq!(*found as f32, *wanted as f32);
    }
    let beyond = large.mapv(|it| 1e5 * it);
    let error = saved(&beyond).to_half().unwrap_err().to_string();
    assert!(
        error.contains("large is beyond the range of f16"),
        "{error}"
    );
}

#[test]
fn without_a_run_a_model_that_comes_with_the_program_dances() {
    let run = TrainedRun::new();
    let clip = fs::read_dir(run.path("data"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let frames = |command: &mut Command, name: &str, model: &'static str| {
        let out = run.path(name);
        command
            .arg("--out")
            .arg(&out)
            .assert()
            .success()
            .stdout(contains(model));
        bvh::read(&out).unwrap().frames()
    };
    let mut between = keydance("generate");
    between
        .arg("--motion")
        .arg(clip.path())
        .args(["--keyframes", "20,80,140"]);
    assert_eq!(
        frames(&mut between, "between.bvh", "comes with keydance"),
        121
    );
    let mut to_music = FIXTURE.command("generate");
    to_music.arg("--music").arg(FIXTURE.file(0, "wav"));
    to_music.arg("--seed-motion").arg(FIXTURE.file(0, "bvh"));
    assert!(frames(&mut to_music, "to_music.bvh", "demo_pu2022") > 200);
    let mut several = FIXTURE.command("generate");
    several.arg("--music").arg(FIXTURE.file(0, "wav"));
    several.arg("--seed-motion").arg(FIXTURE.file(0, "bvh"));
    several
        .args(["--count", "2", "--out"])
        .arg(run.path("several.bvh"));
    several.assert().success().stderr(contains("draws nothing"));
    let mut set = keydance("generate");
    set.args([
        "--set",
        "model.velocity_refinement=false",
        "--out",
        "none.bvh",
    ]);
    set.assert().failure().stderr(contains("RUN_DIR_OR_CONFIG"));
}

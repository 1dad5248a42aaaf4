//! A small training on generated clips: the same losses on any machine, the same bits with any
//! number of threads.
//!
//! The losses are those without dropout: its masks follow from the order of the operations, which
//! may change where the mathematics does not. After a change of the mathematics that is meant,
//! `cargo test --release --test papers golden_run -- --ignored` records the losses anew.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::small_run::{SmallRun, digest, keydance, stderr};

/// Steps that are compared.
const STEPS: usize = 10;
/// Largest difference from a recorded number, relative to it.
const TOLERANCE: f64 = 1e-4;
const WITHOUT_DROPOUT: [&str; 2] = ["--set", "model.dropout=0"];
const RECORDED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/tests/golden/first_losses.json"
);

/// What is recorded of a line of the log.
#[derive(Debug, Serialize, Deserialize)]
struct Step {
    step: u64,
    length: usize,
    teacher_forcing: bool,
    total: f64,
    losses: Map<String, Value>,
    gradient_norm: f64,
}

impl Step {
    fn numbers(&self) -> Vec<(&str, f64)> {
        let terms = self.losses.iter();
        let terms = terms.map(|(name, loss)| (name.as_str(), loss.as_f64().unwrap()));
        let whole = [("total", self.total), ("gradient norm", self.gradient_norm)];
        terms.chain(whole).collect()
    }
}

fn first_steps(run: &Path) -> Vec<Step> {
    let log = fs::read_to_string(run.join("log.jsonl")).unwrap();
    let steps: Vec<Step> = log
        .lines()
        .take(STEPS)
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(steps.len(), STEPS);
    steps
}

fn compare(found: &[Step], recorded: &[Step], kernels: &str) {
    assert_eq!(found.len(), recorded.len());
    for (found, recorded) in found.iter().zip(recorded) {
        let place = |step: &Step| (step.step, step.length, step.teacher_forcing);
        assert_eq!(place(found), place(recorded));
        let step = recorded.step;
        for (found, recorded) in found.numbers().iter().zip(recorded.numbers()) {
            let difference = (found.1 - recorded.1).abs();
            assert!(
                found.0 == recorded.0 && difference <= TOLERANCE * recorded.1.abs(),
                "{kernels}, step {step}: {found:?}, recorded {recorded:?}"
            );
        }
    }
}

#[test]
fn the_first_losses_are_those_recorded_on_every_instruction_set_of_this_cpu() {
    let small = SmallRun::new();
    let text = fs::read_to_string(RECORDED).unwrap();
    let recorded: Vec<Step> = serde_json::from_str(&text).unwrap();
    assert!(recorded.iter().any(|step| !step.teacher_forcing));
    assert!(recorded.iter().any(|step| step.teacher_forcing));
    for kernels in ["avx512", "avx2", "portable"] {
        let run = small.path(kernels);
        let output = keydance()
            .args(small.train_arguments(&run, &WITHOUT_DROPOUT))
            .env("KEYDANCE_ISA", kernels)
            .output()
            .unwrap();
        if !output.status.success() {
            let text = stderr(&output);
            let lacks =
                format!("KEYDANCE_ISA={kernels}: expected an instruction set that this CPU has");
            assert!(kernels != "portable" && text.contains(&lacks), "{text}");
            eprintln!("skipped: this CPU has no {kernels}");
            continue;
        }
        compare(&first_steps(&run), &recorded, kernels);
    }
}

#[test]
fn the_digest_of_the_weights_is_the_same_with_1_2_and_4_threads() {
    let small = SmallRun::new();
    let digests = ["1", "2", "4"].map(|threads| {
        let run = small.path(&format!("run{threads}"));
        digest(&small.train(&run, &["--threads", threads]))
    });
    assert_eq!(digests[0], digests[1]);
    assert_eq!(digests[0], digests[2]);
}

#[test]
fn an_instruction_set_that_there_is_not_is_refused() {
    let output = keydance()
        .args(["runs", "."])
        .env("KEYDANCE_ISA", "mmx")
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let text = stderr(&output);
    assert!(
        text.contains("KEYDANCE_ISA=mmx") && text.contains("portable"),
        "{text}"
    );
}

#[test]
#[ignore = "writes tests/golden/first_losses.json anew"]
fn record_the_first_losses() {
    let small = SmallRun::new();
    let run = small.path("run");
    digest(&small.train(&run, &WITHOUT_DROPOUT));
    let text = serde_json::to_string_pretty(&first_steps(&run)).unwrap();
    fs::write(RECORDED, text + "\n").unwrap();
}

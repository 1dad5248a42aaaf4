//! Commands for those who work on keydance itself, through the binary: gradient checks, batches for
//! other implementations, timings.

use std::path::Path;
use std::process::Output;

use safetensors::{Dtype, SafeTensors};
use serde_json::Value;

use crate::generated_data;
use crate::small_run::{SmallRun, digest, keydance, stderr};

fn run(arguments: &[&str]) -> Output {
    keydance().args(arguments).output().unwrap()
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// A config of the paper's.
fn paper(name: &str) -> String {
    format!(
        "{}/experiments/pan2021/{name}.toml",
        env!("CARGO_MANIFEST_DIR")
    )
}

#[test]
fn gradcheck_compares_every_part_of_a_model_in_every_case() {
    let text = stdout(&run(&[
        "gradcheck",
        "--per-parameter",
        "1",
        "--frames",
        "2",
    ]));
    for words in [
        "N = 2, own predictions fed, dropout on",
        "N = 2, the truth fed, dropout off",
        "root_trajectory_controller",
        "state_decoder",
        "numbers compared",
    ] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let error = text.lines().last().unwrap().rsplit(' ').next().unwrap();
    assert!(error.parse::<f64>().unwrap() < 1e-5, "{text}");

    let ablation = paper("one_lstm");
    let one = [
        "gradcheck",
        &ablation,
        "--per-parameter",
        "1",
        "--frames",
        "1",
    ];
    let text = stdout(&run(&one));
    assert!(text.contains("N = 1,") && !text.contains("lstm2"), "{text}");
}

#[test]
fn gradcheck_leaves_out_what_a_model_is_never_fed() {
    let harvey = paper("harvey");
    let arguments = [
        "gradcheck",
        &harvey,
        "--per-parameter",
        "1",
        "--frames",
        "2",
    ];
    let text = stdout(&run(&arguments));
    assert!(text.contains("own predictions fed"), "{text}");
    assert!(!text.contains("the truth fed"), "{text}");
}

#[test]
fn gradcheck_says_when_there_is_nothing_to_check() {
    let output = run(&["gradcheck", &paper("interpolation")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("needs no training"),
        "{}",
        stderr(&output)
    );
    let output = run(&["gradcheck", "--per-parameter", "0"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("0 is not in 1.."));
}

/// A tensor of a file: its shape and numbers.
fn tensor(content: &[u8], name: &str) -> (Vec<usize>, Vec<f32>) {
    let tensors = SafeTensors::deserialize(content).unwrap();
    let view = tensors.tensor(name).unwrap();
    assert_eq!(view.dtype(), Dtype::F32);
    let numbers = view.data().chunks_exact(4);
    let numbers = numbers.map(|x| f32::from_le_bytes(x.try_into().unwrap()));
    (view.shape().to_vec(), numbers.collect())
}

#[test]
fn an_exported_batch_holds_windows_outputs_losses_and_the_gradient_of_every_weight() {
    let small = SmallRun::new();
    let trained = small.path("run");
    digest(&small.train(&trained, &[]));
    let export = |name: &str, more: &[&str]| {
        let file = small.path(name);
        let output = keydance()
            .arg("export-batch")
            .arg(&trained)
            .arg("--data")
            .arg(small.path("data"))
            .arg("--out")
            .arg(&file)
            .args(more)
            .output()
            .unwrap();
        (output, file)
    };
    let content = |name: &str, more: &[&str]| {
        let (output, file) = export(name, more);
        stdout(&output);
        std::fs::read(file).unwrap()
    };
    let size = ["--frames", "6", "--windows", "3"];
    let own = content("own.safetensors", &size);
    let fed = content(
        "fed.safetensors",
        &[&size[..], &["--ground-truth"]].concat(),
    );
    assert_eq!(tensor(&own, "window").0, [7, 3, 154]);
    assert_eq!(tensor(&own, "outputs").0, [6, 3, 149]);
    // The same windows and predictions; the losses are of other rollouts.
    for name in ["window", "outputs"] {
        assert_eq!(tensor(&own, name), tensor(&fed, name));
    }
    assert_ne!(tensor(&own, "loss.total"), tensor(&fed, "loss.total"));
    assert_eq!(tensor(&fed, "ground_truth_fed").1, [1.0]);

    let weights = std::fs::read(trained.join("weights.safetensors")).unwrap();
    let weights = SafeTensors::deserialize(&weights).unwrap();
    let statistics = [
        "feature_mean",
        "feature_std",
        "position_scale",
        "velocity_scale",
    ];
    let mut parameters = 0;
    for (name, view) in weights
        .iter()
        .filter(|(name, _)| !statistics.contains(name))
    {
        let (shape, gradient) = tensor(&own, &format!("gradient.{name}"));
        assert_eq!(shape, view.shape(), "{name}");
        assert!(gradient.iter().all(|x| x.is_finite()));
        parameters += 1;
    }
    assert!(parameters > 20);

    let (output, file) = export("long.safetensors", &["--frames", "60"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("the 61 frames that --frames 60 needs"),
        "{}",
        stderr(&output)
    );
    assert!(!Path::new(&file).exists());
}

#[test]
fn a_training_step_of_every_kind_of_model_is_timed() {
    for (config, frames, sizes) in [
        ("li2023/ours", "12", "model.layers=1"),
        (
            "pu2022/small",
            "62",
            "model.cross_layers=1 model.music_layers=1 schedule.key_poses=1",
        ),
        (
            "valleperez2021/transflower",
            "12",
            "model.cross_layers=1 model.width=40 model.blocks=1",
        ),
        (
            "valleperez2021/deterministic",
            "12",
            "model.cross_layers=1 model.width=40",
        ),
        (
            "valleperez2021/moglow",
            "12",
            "model.blocks=1 model.hidden=16",
        ),
    ] {
        let folder = env!("CARGO_MANIFEST_DIR");
        let file = format!("{folder}/experiments/{config}.toml");
        let mut arguments = vec!["bench-step", &file, "--batch", "1", "--frames", frames];
        arguments.extend(["--repetitions", "1", "--threads", "1", "--json"]);
        for size in sizes.split(' ') {
            arguments.extend(["--set", size]);
        }
        let output = run(&arguments);
        let error = stderr(&output);
        assert!(output.status.success(), "{config}: {error}");
        let json: Value = serde_json::from_str(&stdout(&output)).unwrap();
        let speed = json["frame_steps_per_second"].as_f64().unwrap();
        assert!(speed > 0.0, "{config}");
    }
}

#[test]
fn timings_are_printed_as_a_line_of_text_or_json() {
    let once = ["--repetitions", "1", "--threads", "1"];
    for (command, size, key) in [
        (
            "bench-step",
            &["--frames", "1", "--batch", "2", "--shards", "1"][..],
            "frame_steps_per_second",
        ),
        ("bench-generate", &["--batch", "1"], "frames_per_second"),
        ("bench-layers", &[], ""),
    ] {
        let arguments = [&[command], size, &once].concat();
        let text = stdout(&run(&arguments));
        assert!(
            text.contains("ms") || text.contains("frame"),
            "{command}: {text}"
        );
        let json = stdout(&run(&[&arguments[..], &["--json"]].concat()));
        let json: Value = serde_json::from_str(&json).unwrap();
        let numbers = json.as_object().unwrap();
        assert!(!numbers.is_empty(), "{command}: {json}");
        if !key.is_empty() {
            assert!(json[key].as_f64().unwrap() > 0.0, "{command}: {json}");
        }
    }
}

#[test]
fn output_that_is_read_no_further_ends_the_program_quietly() {
    let (reader, closed) = std::io::pipe().unwrap();
    drop(reader);
    let clips = tempfile::tempdir().unwrap();
    generated_data::write_clips(clips.path(), 3, 1);
    let clip = clips.path().read_dir().unwrap().next().unwrap().unwrap();
    let mut program = keydance();
    program.args(["bvh", "inspect"]).arg(clip.path());
    let output = program.stdout(closed).output().unwrap();
    assert_eq!(stderr(&output), "");
    assert_eq!(output.status.code(), Some(141));
}

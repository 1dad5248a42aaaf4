//! The programs of `examples/`, which `cargo test` builds.

use std::path::Path;

use assert_cmd::Command;
use predicates::str::contains;
use tempfile::TempDir;

use crate::generated_data::write_clips;

fn example(name: &str) -> Command {
    let binary = assert_cmd::cargo::cargo_bin("keydance");
    let example = binary.with_file_name("examples").join(name);
    let found = example
        .with_extension(std::env::consts::EXE_EXTENSION)
        .exists();
    assert!(
        found,
        "{name} is not built: `cargo test` builds it, or `cargo build --examples`"
    );
    Command::new(example)
}

#[test]
fn what_learns_has_learned_at_its_end() {
    for (name, bound) in [("sine", 1e-3), ("lstm", 5e-3), ("attention", 5e-3)] {
        let output = example(name).assert().success();
        let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
        let losses = text.lines().filter_map(|line| line.split(": ").nth(1));
        let losses: Vec<f64> = losses.map(|loss| loss.parse().unwrap()).collect();
        let (first, last) = (losses[0], losses[losses.len() - 1]);
        assert!(last < bound && last < 0.1 * first, "{name}: {text}");
    }
}

#[test]
fn an_operation_of_ones_own_has_its_gradient() {
    let output = example("custom_operation").assert().success();
    output.stdout(contains("of x [0.2384, 1.0000, 1.9051]"));
}

#[test]
fn a_clip_is_read_and_written_and_a_model_is_used_from_code() {
    let folder = TempDir::new().unwrap();
    write_clips(folder.path(), 60, 3);
    let mut files = std::fs::read_dir(folder.path()).unwrap();
    let clip = files.next().unwrap().unwrap().path();
    let backwards = folder.path().join("backwards.bvh");
    let written = example("bvh").args([&clip, &backwards]).assert();
    written.success().stdout(contains("24 joints, 60 frames"));
    let again = folder.path().join("again.bvh");
    example("bvh").args([&backwards, &again]).assert().success();
    let [there, here] = [&clip, &again].map(|path| std::fs::read_to_string(path).unwrap());
    assert_eq!(there, here);
    let config = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = config.join("experiments/pan2021/interpolation.toml");
    let generated = example("generate").args([&config, &clip]).assert();
    generated.success().stdout(contains("frame  30: "));
    let usage = example("generate").assert().failure();
    usage.stderr(contains("give RUN_OR_CONFIG CLIP.bvh"));
}

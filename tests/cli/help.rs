//! What the program says of itself.

use std::fs;
use std::path::Path;

use clap::Parser as _;
use keydance::cli::Cli;
use keydance::data::DataConfig;
use keydance::evaluation::EvaluationOptions;
use keydance::models::registry;

use crate::small_run::keydance;

fn said(arguments: &[&str]) -> String {
    let output = keydance().args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The subcommands in the order of the help.
fn commands() -> Vec<String> {
    let text = said(&["--help"]);
    let lines = text.lines().skip_while(|line| *line != "Commands:").skip(1);
    let lines = lines.take_while(|line| line.starts_with("  "));
    let names = lines.filter_map(|line| line.split_whitespace().next());
    names.map(String::from).collect()
}

#[test]
fn main_commands_come_first_and_benchmarks_last() {
    let names = commands();
    let main = ["demo", "train", "evaluate", "generate", "reproduce"];
    assert_eq!(names[..5], main, "{names:?}");
    let benchmarks = ["bench-step", "bench-layers", "bench-generate", "help"];
    assert_eq!(names[names.len() - 4..], benchmarks, "{names:?}");
}

#[test]
fn each_command_shows_examples_that_it_understands() {
    let names = commands();
    for name in names.iter().filter(|name| *name != "help") {
        let text = said(&[name, "--help"]);
        let (_, examples) = text.split_once("Examples:\n").expect(name);
        let examples = examples.replace("\\\n", " ");
        let lines = examples.lines().take_while(|line| !line.is_empty());
        let mut count = 0;
        for line in lines {
            let words = words(line);
            assert_eq!(words[..2], ["keydance", name], "{line}");
            let parsed = Cli::try_parse_from(words);
            assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
            count += 1;
        }
        assert!(count > 0, "{name}");
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/cli/help");
    assert_eq!(fs::read_dir(folder).unwrap().count(), names.len() - 1);
}

/// The words of a line as a shell has them; a comment is none.
fn words(line: &str) -> Vec<String> {
    let line = line.split(" # ").next().unwrap_or_default();
    let mut words = Vec::new();
    for (k, part) in line.split('"').enumerate() {
        match k % 2 {
            0 => words.extend(part.split_whitespace().map(String::from)),
            _ => words.push(part.into()),
        }
    }
    words
}

#[test]
fn the_version_has_the_commit_that_it_was_built_from() {
    let text = said(&["--version"]);
    let version = concat!("keydance ", env!("CARGO_PKG_VERSION"));
    assert!(text.starts_with(version), "{text}");
    if let Some(commit) = option_env!("KEYDANCE_COMMIT") {
        assert!(text.contains(&format!("(commit {commit})")), "{text}");
    }
}

#[test]
fn the_help_of_evaluate_lists_the_protocols_of_every_paper() {
    let text = said(&["evaluate", "--help"]);
    let (data, options) = (DataConfig::default(), EvaluationOptions::default());
    for paper in registry::papers() {
        let mut lines = text.lines().map(str::trim);
        let line = lines.find(|line| line.starts_with(&format!("{} ", paper.name)));
        let line = line.expect(paper.name);
        for protocol in (paper.protocols)(&data, &options) {
            assert!(line.contains(protocol.name()), "{line}");
        }
    }
}

#[test]
fn the_help_of_generate_says_that_a_model_reads_controls_of_its_own() {
    let text = said(&["generate", "--help"]);
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("Which controls change the motion depends on the model"));
}

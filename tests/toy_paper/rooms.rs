//! The rule of the house: what all papers share names none of them.

use std::fs;
use std::path::{Path, PathBuf};

use keydance::models::registry;

/// Papers, models and what only some of them have.
const NAMES: [&str; 12] = [
    "pan2021",
    "harvey",
    "li2023",
    "duan2022",
    "pu2022",
    "valleperez",
    "transflower",
    "moglow",
    "whole_model",
    "keyframe",
    "transformer",
    "154",
];

fn rust_files(folder: &Path, deep: bool, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() && deep {
            rust_files(&path, deep, found);
        } else if path.extension().is_some_and(|end| end == "rs") {
            found.push(path);
        }
    }
}

#[test]
fn the_rooms_that_all_papers_share_name_no_paper_no_model_and_nothing_of_one() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    for room in ["training", "step", "run", "experiment", "optim"] {
        rust_files(&source.join(room), true, &mut files);
    }
    let before = files.len();
    // A protocol may name its paper: a folder of its own, under the papers' feature.
    rust_files(&source.join("evaluation"), false, &mut files);
    assert!(before > 20 && files.len() > before);
    let kinds = registry::kinds();
    for file in files {
        let text = fs::read_to_string(&file).unwrap().to_lowercase();
        let file = file.display();
        let rule = "what is a paper's own lies in a folder of its own";
        for name in NAMES {
            assert!(!text.contains(name), "{file}: {name}; {rule}");
        }
        let mut words = text.split(|c: char| !(c.is_alphanumeric() || c == '_'));
        let word = words.find(|word| kinds.iter().any(|kind| kind.name() == *word));
        assert_eq!(word, None, "{file}; {rule}");
    }
}

/// Builds the crate without the papers' folders and runs the tests of the toy paper there.
#[cfg(feature = "papers")]
#[test]
fn with_every_papers_folder_taken_out_the_toy_paper_still_passes() {
    let mut cargo = std::process::Command::new(env!("CARGO"));
    cargo.args(["test", "--locked", "--quiet", "--no-default-features"]);
    cargo.args(["--test", "toy_paper"]);
    if !cfg!(debug_assertions) {
        cargo.arg("--release");
    }
    let output = cargo
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    let text = [output.stdout, output.stderr].concat();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&text)
    );
}

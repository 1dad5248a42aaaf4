//! What README.md and docs/ say that can be checked.

use std::fs;
use std::path::{Path, PathBuf};

/// README.md and the files of docs/, each with its text.
fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = vec![root.join("README.md")];
    let docs = fs::read_dir(root.join("docs")).unwrap();
    files.extend(docs.map(|entry| entry.unwrap().path()));
    files.retain(|file| file.extension().is_some_and(|extension| extension == "md"));
    files
        .into_iter()
        .map(|file| {
            let text = fs::read_to_string(&file).unwrap();
            (file, text)
        })
        .collect()
}

#[test]
fn every_file_of_experiments_that_the_documents_name_exists() {
    const FOLDER: &str = "experiments/";
    let mut named = 0;
    for (document, text) in documents() {
        for (start, _) in text.match_indices(FOLDER) {
            let of_path = |letter: char| letter.is_alphanumeric() || "/._-".contains(letter);
            let path: String = text[start..].chars().take_while(|c| of_path(*c)).collect();
            // A full stop behind a path ends the sentence.
            let path = path.trim_end_matches('.');
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
            assert!(file.exists(), "{} names {path}", document.display());
            named += 1;
        }
    }
    assert!(named > 5, "{named} paths found");
}

//! A model that is hardly trained, on generated clips, through the binary: for tests of what is
//! done with a run.

use std::fs;
use std::path::PathBuf;

use assert_cmd::Command;
use tempfile::TempDir;

use crate::generated_data::write_clips;

const INTERPOLATION: &str =
    "name = 'interpolation'\n[data]\nsplit = { share = 0.8 }\n[model]\nkind = 'interpolation'\n";
const SMALL: &str = "name = 'small'\n[data]\nsplit = { share = 0.8 }\n\
    [model]\nkind = 'pan2021'\nhidden = 8\ncode = 8\nheads = 2\nfeed_forward = 8\nencoder_layers = 1\ndecoder_layers = 1\n\
    [schedule]\nmax_len = 6\nfraction = 0.05\nbatch_size = 8\nshards = 1\n[checkpoint]\nevery_steps = 5\n";

/// A folder with six clips of 180 frames in `data`, the configs `interpolation.toml` and
/// `small.toml`, and the latter's `run`.
pub struct TrainedRun {
    folder: TempDir,
}

impl TrainedRun {
    pub fn new() -> Self {
        let fixture = Self {
            folder: TempDir::new().unwrap(),
        };
        fs::create_dir(fixture.path("data")).unwrap();
        write_clips(&fixture.path("data"), 180, 3);
        fs::write(fixture.path("interpolation.toml"), INTERPOLATION).unwrap();
        fs::write(fixture.path("small.toml"), SMALL).unwrap();
        keydance("train")
            .arg(fixture.path("small.toml"))
            .arg("--data")
            .arg(fixture.path("data"))
            .arg("--out")
            .arg(fixture.path("run"))
            .assert()
            .success();
        fixture
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// The program with a subcommand.
pub fn keydance(command: &str) -> Command {
    let mut keydance = Command::cargo_bin("keydance").unwrap();
    keydance.arg(command);
    keydance
}

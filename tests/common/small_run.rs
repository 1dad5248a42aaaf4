//! A small whole model on generated clips, trained through the binary.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

use crate::generated_data::write_clips;

/// Some 70 steps with a checkpoint every third; the curriculum changes on the way.
const CONFIG: &str = "name = 'small'\n[data]\nsplit = { share = 0.8 }\n\
    [model]\nkind = 'pan2021'\nhidden = 32\ncode = 16\nheads = 2\nfeed_forward = 16\nencoder_layers = 1\ndecoder_layers = 1\n\
    [schedule]\nmin_len = 5\nmax_len = 8\nmin_len_step = 1\nmin_len_every = 2\nbatch_size = 16\nshards = 3\nfraction = 0.4\n\
    [optimiser]\nlearning_rate = 0.001\n[scheduled_sampling]\ndecay = 0.7\n[checkpoint]\nevery_steps = 3\n";

/// A folder with generated clips and the config.
pub struct SmallRun {
    folder: TempDir,
}

impl SmallRun {
    pub fn new() -> Self {
        let folder = TempDir::new().unwrap();
        fs::create_dir(folder.path().join("data")).unwrap();
        write_clips(&folder.path().join("data"), 60, 3);
        fs::write(folder.path().join("small.toml"), CONFIG).unwrap();
        Self { folder }
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The arguments of `keydance train` into a run's folder.
    pub fn train_arguments(&self, run: &Path, more: &[&str]) -> Vec<String> {
        let path = |path: &Path| path.to_str().unwrap().to_string();
        let mut arguments = vec!["train".into(), path(&self.path("small.toml"))];
        arguments.extend(["--data".into(), path(&self.path("data"))]);
        arguments.extend(["--out".into(), path(run)]);
        arguments.extend(more.iter().map(ToString::to_string));
        arguments
    }

    pub fn train(&self, run: &Path, more: &[&str]) -> Output {
        keydance()
            .args(self.train_arguments(run, more))
            .output()
            .unwrap()
    }
}

/// The program.
pub fn keydance() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("keydance"))
}

pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// The digest of the weights that a finished training prints last.
pub fn digest(output: &Output) -> String {
    assert!(output.status.success(), "{}", stderr(output));
    let text = String::from_utf8_lossy(&output.stdout);
    let last = text.lines().last().unwrap_or_default();
    let digest = last.strip_prefix("weights ").unwrap_or_default();
    assert_eq!(digest.len(), 64, "{text}");
    digest.into()
}

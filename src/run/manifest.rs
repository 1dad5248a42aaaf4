//! A run's manifest: what was trained, on what, where, and how far it got.

use std::fmt;
use std::time::SystemTime;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use crate::autograd::kernels::Isa;
use crate::data::{DataPart, Dataset};
use crate::experiment::ExperimentConfig;
use crate::models::Task;

/// Format of the manifest; raised when an older program would misread a newer one. Manifests from
/// before it was written have 1.
pub(crate) const FORMAT: u32 = 1;

/// A version of this program.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Build {
    pub version: String,
    /// The commit, where it was built in a git checkout.
    pub commit: Option<String>,
}

impl Build {
    /// The version that runs.
    pub fn this() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            commit: option_env!("KEYDANCE_COMMIT").map(Into::into),
        }
    }
}

impl fmt::Display for Build {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.commit {
            Some(commit) => write!(f, "{} (commit {commit})", self.version),
            None => f.write_str(&self.version),
        }
    }
}

/// How a run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// Running, or ended without a word: then the newest checkpoint says how far it got.
    Running,
    /// Stopped on request, saved.
    Stopped,
    /// A loss or gradient was not finite.
    Diverged,
    Finished,
}

/// `manifest.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    #[serde(default = "first_format")]
    pub format: u32,
    /// The config's name.
    pub name: String,
    pub seed: u64,
    pub state: RunState,
    /// Version of keydance, and its commit where it was built in a git checkout.
    pub version: String,
    pub commit: Option<String>,
    pub cpu: String,
    /// Instruction sets that its steps were computed with, each where it took over from the one
    /// before. None where the run's version did not keep it.
    #[serde(default)]
    pub instructions: Vec<String>,
    pub threads: usize,
    /// Processes that shared the steps, each with as many threads.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub ranks: usize,
    /// UTC, RFC 3339.
    pub started: String,
    pub finished: Option<String>,
    /// Wall-clock time of training, over all resumptions.
    pub seconds: f64,
    pub steps_done: u64,
    pub steps: u64,
    pub frame_steps_done: u64,
    pub frame_steps: u64,
    pub train: Part,
    pub test: Part,
    pub data_digest: String,
    /// Weights in all parameters together.
    pub parameters: usize,
    /// SHA-256 of the weights (see [`crate::models::weights::digest`]), once finished.
    pub weights_digest: Option<String>,
    /// SHA-256 of the file of these weights; none where the run's version did not keep it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights_file_digest: Option<String>,
    /// The step of the best validation score, where the weights at the end are its.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best_step: Option<u64>,
    /// What the task says of its schedule and the training data, see [`Task::facts`].
    #[serde(flatten)]
    pub facts: Map<String, Value>,
}

fn first_format() -> u32 {
    1
}

fn one() -> usize {
    1
}

fn is_one(ranks: &usize) -> bool {
    *ranks == 1
}

/// Size of a part of the data.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    pub clips: usize,
    pub frames: usize,
}

impl Part {
    fn of(dataset: &Dataset, part: DataPart) -> Self {
        let (clips, frames) = dataset.size(part);
        Self { clips, frames }
    }
}

impl Manifest {
    /// One of the [facts](Manifest::facts); none where the run's version did not keep it.
    pub fn fact<T: serde::de::DeserializeOwned>(&self, name: &str) -> Option<T> {
        let value = self.facts.get(name)?.clone();
        serde_json::from_value(value).ok()
    }

    /// The manifest of a run that begins now.
    pub(crate) fn new(
        config: &ExperimentConfig,
        dataset: &Dataset,
        task: &dyn Task<f32>,
        parameters: usize,
        (ranks, threads): (usize, usize),
    ) -> Self {
        let Build { version, commit } = Build::this();
        Self {
            format: FORMAT,
            name: config.name.clone(),
            seed: config.seed,
            state: RunState::Running,
            version,
            commit,
            cpu: cpu(),
            instructions: vec![instructions()],
            threads,
            ranks,
            started: now(),
            finished: None,
            seconds: 0.0,
            steps_done: 0,
            steps: task.steps(),
            frame_steps_done: 0,
            frame_steps: task.frame_steps(),
            train: Part::of(dataset, DataPart::Train),
            test: Part::of(dataset, DataPart::Test),
            data_digest: dataset.digest.clone(),
            parameters,
            weights_digest: None,
            weights_file_digest: None,
            best_step: None,
            facts: task.facts(),
        }
    }
}

/// This moment, UTC, RFC 3339.
pub(crate) fn now() -> String {
    humantime::format_rfc3339_seconds(SystemTime::now()).to_string()
}

/// The instruction set of the kernels: the bits of a training follow from it.
pub(crate) fn instructions() -> String {
    match Isa::detected() {
        Isa::Portable => format!("portable {}", std::env::consts::ARCH),
        isa => isa.name().into(),
    }
}

/// The CPU's name where the system tells it, else its architecture.
fn cpu() -> String {
    let name = std::fs::read_to_string("/proc/cpuinfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_string())
        });
    name.unwrap_or_else(|| std::env::consts::ARCH.into())
}

//! What can end a training before its end.

use std::path::PathBuf;

use thiserror::Error;

use crate::autograd::AutogradError;
use crate::data::DataError;
use crate::evaluation::EvaluationError;
use crate::experiment::layers::ConfigError;
use crate::models::ModelError;
use crate::models::weights::WeightsError;
use crate::run::checkpoint::CheckpointError;
use crate::run::durable::FileError;
use crate::run::state::StateError;

/// Why a training cannot begin, go on or be saved.
#[derive(Debug, Error)]
pub enum TrainingError {
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A clip's mirror image cannot be measured.
    #[error(transparent)]
    Data(#[from] Box<DataError>),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(
        "the schedule has no step: no window of {min_len} to {max_len} frames at fraction {fraction} of {clips} training clips, the longest of \
         {longest} frames; raise schedule.fraction, or lower schedule.batch_size or schedule.min_len"
    )]
    NothingToTrain {
        min_len: usize,
        max_len: usize,
        fraction: f64,
        clips: usize,
        longest: usize,
    },
    #[error("no pool of {threads} threads: {cause}")]
    Threads {
        threads: usize,
        cause: rayon::ThreadPoolBuildError,
    },
    /// An operation of the network refused its operands.
    #[error("step {step} ({windows} windows of {length} frames): {cause}")]
    Step {
        step: u64,
        windows: usize,
        length: usize,
        cause: Box<AutogradError>,
    },
    /// The training diverged, at this step or, where its cause are the weights, in the update that ended it.
    #[error(
        "step {step} ({windows} windows of {length} frames) is not finite: {cause}; the last checkpoint is as it was; \
         try a lower optimiser.learning_rate or optimiser.clip_norm=1.0"
    )]
    NonFinite {
        /// Counted from 1.
        step: u64,
        windows: usize,
        length: usize,
        /// Operation and shapes.
        cause: String,
    },
    #[error("step {step} cannot be scored on the validation clips: {cause}")]
    Validation {
        step: u64,
        cause: Box<EvaluationError>,
    },
    #[error(
        "validation.every_steps needs validation clips; set some aside with data.validation_share, such as 0.1, or leave [validation] out"
    )]
    NoValidationClips,
    #[error(
        "validation.lengths has {length}, but the longest of the validation clips has {longest} frames; give lengths of fewer frames"
    )]
    ValidationLength { length: usize, longest: usize },
    #[error("{path}, line {line}, is no line of a training's log: {cause}")]
    Log {
        path: PathBuf,
        line: usize,
        cause: serde_json::Error,
    },
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Weights(#[from] WeightsError),
    #[error(transparent)]
    State(#[from] StateError),
    #[error("{path} holds a run already; go on with --resume, or give another --out")]
    RunExists { path: PathBuf },
    #[error(
        "another training writes to {path} at this moment; wait for its end or stop it, or give another --out"
    )]
    Locked { path: PathBuf },
    /// What a run of another version of the program holds cannot be read or gone on with by this one.
    #[error("{path} was made by keydance {made_by}, this is {this}, which cannot use it: {cause}")]
    OtherVersion {
        path: PathBuf,
        made_by: String,
        this: String,
        cause: Box<TrainingError>,
    },
    #[error("{path} has format {found}, and this version of keydance knows formats up to {newest}")]
    ManifestFormat {
        path: PathBuf,
        found: u32,
        newest: u32,
    },
    #[error(
        "{path} holds a run with another config ({}); values there, values now; a run is resumed with the config and the --set \
         that it was started with",
        differences.join("; ")
    )]
    OtherConfig {
        path: PathBuf,
        differences: Vec<String>,
    },
    #[error(
        "{path} was trained on data with digest {saved}, the data folder now has digest {found}"
    )]
    OtherData {
        path: PathBuf,
        saved: String,
        found: String,
    },
    #[error("{path} belongs to a config with digest {saved}, the run's config has digest {found}")]
    OtherRun {
        path: PathBuf,
        saved: String,
        found: String,
    },
    #[error(
        "{path} holds no weights, neither of a finished training nor of a checkpoint; train it with `keydance train`"
    )]
    NoWeights { path: PathBuf },
    #[error(
        "{path} holds the weights of another model than the config describes ({}); values there, values of the config",
        differences.join("; ")
    )]
    OtherModel {
        path: PathBuf,
        differences: Vec<String>,
    },
    #[error("no checkpoint of {path} can be used: {}", problems.join("; "))]
    NoCheckpoint {
        path: PathBuf,
        problems: Vec<String>,
    },
    #[error("{path} is not a manifest: {cause}")]
    Manifest {
        path: PathBuf,
        cause: serde_json::Error,
    },
    #[error("{path} does not fit the model: {problem}")]
    Checkpoint {
        path: PathBuf,
        problem: CheckpointError,
    },
}

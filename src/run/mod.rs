//! A run's folder: config, manifest, log, checkpoints, weights, each there whole or not at all.

mod best;
mod built_in;
pub mod checkpoint;
mod durable;
mod error;
mod folder;
mod lock;
pub(crate) mod log;
pub mod manifest;
mod output;
mod packing;
mod partial;
pub mod state;
mod status;
mod subject;
mod trained_model;

pub use built_in::BuiltIn;
pub use durable::FileError;
pub(crate) use durable::{remove as remove_file, replace as replace_file, write_json};
pub use error::RunError;
pub use folder::RunFolder;
pub use log::LogLine;
pub use manifest::{Manifest, RunState};
pub use output::{beside_clips, check_output_folder, check_outputs, check_outputs_beside};
pub(crate) use partial::Partial;
pub use status::RunProgress;
pub use subject::Subject;

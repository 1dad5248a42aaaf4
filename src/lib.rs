//! Dance synthesis: the models of several papers, side by side.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`] - BVH, skeletons, poses, kinematics, facing, contact; no learning.
//! - [`data`] - files become recordings, recordings a split.
//! - [`autograd`] - reverse-mode differentiation on a tape, and the kernels under it.
//! - [`nn`] - layers of weights, built on the tape's operations.
//! - [`optim`] - Adam, groups of learning rates, schedules.
//! - [`models`] - a folder a paper, behind two traits: [`models::Task`] and [`models::Generator`].
//! - [`training`] - the loop over a task's steps; it names no paper.
//! - [`run`] - a run's folder: checkpoints, manifest, log, lock.
//! - [`experiment`] - configs in layers, rows, whole tables reproduced.
//! - [`evaluation`] - metrics, scores, a file a protocol, tables.
//! - [`synthesis`] - what a model gives becomes motion that can be played.
//! - [`report`] - charts, the motion viewer, the figures of papers.
//! - [`cli`] - the subcommands of the binary: arguments and printing only.
//!
//! > Training knows steps. A paper knows its data. A protocol knows scores. A request knows what is
//! > given.
#![deny(unsafe_code)]
// They panic where the output is closed: writeln! with its error to stdout, cli::notice to stderr.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod autograd;
#[cfg(feature = "cli")]
pub mod cli;
pub mod data;
pub mod evaluation;
pub mod experiment;
pub mod models;
pub mod motion;
pub mod nn;
pub mod optim;
pub mod report;
pub mod run;
#[cfg(feature = "papers")]
pub mod synthesis;
pub mod training;

// What the signatures are made of, in the versions that they are made of.
pub use {ndarray, rand};

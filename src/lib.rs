//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`] - BVH files become clips, clips become the features of each frame.
//! - [`data`] - clips become a data set: split, standardised, cut into windows.
//! - [`autograd`] - reverse-mode differentiation on a tape, and the kernels under it.
//! - [`nn`] - layers of weights, built on the tape's operations.
//! - [`optim`] - Adam.
//! - [`models`] - what fills the frames between two keyframes, behind one trait.
//! - [`training`] - curriculum, scheduled sampling, losses, the loop, checkpoints.
//! - [`evaluation`] - LRP, AVF and ART by the paper's protocol, and its tables.
//! - [`synthesis`] - predicted frames become motion that can be played.
//! - [`report`] - figures of losses, scores and dancers.
//! - [`cli`] - the subcommands of the binary.
#![deny(unsafe_code)]
// They panic where the output is closed: writeln! with its error to stdout, cli::notice to stderr.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod autograd;
#[cfg(feature = "papers")]
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

//! Dance synthesis: the models of several papers, side by side, on an autograd engine of its own.
//!
//! ```
//! use keydance::autograd::{Gradients, Parameters, Tape, Workspace};
//!
//! let mut parameters = Parameters::<f64>::new();
//! let (_, weight) = parameters.add("weight", ndarray::arr1(&[3.0, -1.0]).into_dyn());
//! let (mut gradients, mut workspace) = (Gradients::zeros(&parameters), Workspace::new());
//! let mut tape = Tape::recording(&parameters, &mut workspace);
//! let weight = tape.block(weight);
//! let squares = tape.square(weight);
//! let loss = tape.sum(squares);
//! tape.backward(loss, &mut gradients)?;
//! assert_eq!(gradients.iter().next(), Some(&[6.0, -2.0][..]));
//! # Ok::<(), keydance::autograd::AutogradError>(())
//! ```
//!
//! `examples/` has an MLP with Adam on a sine, an LSTM, attention, an operation of one's own, BVH
//! in and out, and a model used from code. A crate that needs no command line depends on a clone:
//!
//! ```toml
//! [dependencies] # without "papers": the engine alone; with "music": the engine and ears
//! keydance = { path = "../keydance", default-features = false, features = ["papers"] }
//! rand_chacha = "0.10" # a generator for `Initialiser`; ndarray and rand are re-exported
//!
//! [dev-dependencies] # for `autograd::check::property`
//! keydance = { path = "../keydance", default-features = false, features = ["proptest"] }
//! ```
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`] - BVH, skeletons, poses, kinematics, facing, contact; no learning.
//! - [`music`] - sound files, spectra, onsets, tempo, beats; no learning.
//! - [`data`] - files become recordings, recordings a split.
//! - [`autograd`] - reverse-mode differentiation on a tape, and the kernels under it.
//! - [`nn`] - layers of weights, built on the tape's operations.
//! - [`optim`] - Adam, groups of learning rates, schedules.
//! - [`models`] - a folder a paper, behind two traits: [`models::Task`] and [`models::Generator`].
//! - [`ranks`] - processes that train one model together.
//! - [`training`] - the loop over a task's steps; it names no paper.
//! - [`run`] - a run's folder: checkpoints, manifest, log, lock.
//! - [`experiment`] - configs in layers, rows, whole tables reproduced.
//! - [`evaluation`] - metrics, scores, a file a protocol, tables.
//! - [`synthesis`] - what a model gives becomes motion that can be played.
//! - [`report`] - charts, the motion viewer, the figures of papers, the user study.
//! - [`cli`] - the subcommands of the binary: arguments and printing only.
//!
//! > Training knows steps. A paper knows its data. A protocol knows scores. A request knows what is
//! > given.
#![deny(unsafe_code)]
// They panic where the output is closed: writeln! with its error to stdout, cli::notice to stderr.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod counted;

pub mod autograd;
#[cfg(feature = "cli")]
pub mod cli;
pub mod data;
pub mod evaluation;
pub mod experiment;
pub mod models;
pub mod motion;
#[cfg(feature = "music")]
pub mod music;
pub mod nn;
pub mod optim;
pub mod ranks;
pub mod report;
pub mod run;
pub mod step;
#[cfg(feature = "papers")]
pub mod synthesis;
pub mod training;

// What the signatures are made of, in the versions that they are made of.
pub use {ndarray, rand};

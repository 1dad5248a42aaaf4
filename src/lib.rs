//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
//! - [`data`]: clips become a data set: split, standardised, cut into windows.
//! - [`models`]: what fills the frames between two keyframes, behind one trait.
//! - [`evaluation`]: LRP, AVF and ART by the paper's protocol, and its tables.
//! - [`report`]: figures of losses, scores and dancers.
//! - [`cli`]: the subcommands of the binary.
pub mod cli;
pub mod data;
pub mod evaluation;
pub mod models;
pub mod motion;
pub mod report;

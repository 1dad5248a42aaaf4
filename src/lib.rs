//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
//! - [`data`]: clips become a data set: split, standardised, cut into windows.
//! - [`cli`]: the subcommands of the binary.
pub mod cli;
pub mod data;
pub mod motion;

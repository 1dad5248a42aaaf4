//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
//! - [`data`]: clips become a data set: split, standardised, cut into windows.
//! - [`autograd`]: reverse-mode differentiation on a tape, and the kernels under it.
//! - [`cli`]: the subcommands of the binary.
#![deny(unsafe_code)]

pub mod autograd;
pub mod cli;
pub mod data;
pub mod motion;

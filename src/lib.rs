//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
//! - [`autograd`]: reverse-mode differentiation and the kernels under it.
#![deny(unsafe_code)]

pub mod autograd;
pub mod motion;

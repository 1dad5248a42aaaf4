//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
pub mod motion;

//! Dance synthesis from keyframes.
//!
//! The modules in reading order, the path of the data:
//!
//! - [`motion`]: BVH files become clips, clips become the features of each frame.
//! - [`data`]: data sets; the built-in choreography generator.
pub mod data;
pub mod motion;

//! Motion without learning: skeletons, clips, BVH files, forward kinematics, the features of a frame.
//!
//! Units: centimetres, radians, seconds; Y is up. Computed in f64.

pub mod clip;
pub mod ik;
pub mod skeleton;

pub use clip::{Clip, Pose};
pub use skeleton::{DANCE_JOINTS, DANCE_PARENTS, Joint, Skeleton};

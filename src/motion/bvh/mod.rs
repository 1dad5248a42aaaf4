//! BVH files: the document, its reader and its writer, and the way to clips and back.
//!
//! Rotations are composed in the order of a joint's channels, the first listed outermost:
//! `Zrotation Xrotation Yrotation` means `R = Rz Rx Ry`, degrees. A position channel replaces its
//! part of the joint's offset.

mod document;
mod error;
mod euler;
mod from_clip;
mod hierarchy;
mod inspection;
mod reader;
mod rows;
mod scanner;
mod to_clip;
mod writer;

pub use document::{Axis, Bvh, Channel};
pub use error::BvhError;
pub use from_clip::channel_layout;
pub use inspection::Inspection;
pub use reader::{parse, read};
pub use writer::write;

//! BVH files: the document, its reader and its writer, and the way to clips and back.
//!
//! Rotations are composed in the order of a joint's channels, the first listed outermost:
//! `Zrotation Xrotation Yrotation` means `R = Rz Rx Ry`, degrees. A position channel replaces its
//! part of the joint's offset.
//!
//! ```
//! use keydance::motion::bvh::{Bvh, parse};
//!
//! let text = "\
//! HIERARCHY
//! ROOT Hips
//! {
//!   OFFSET 0 0 0
//!   CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
//!   End Site
//!   {
//!     OFFSET 0 10 0
//!   }
//! }
//! MOTION
//! Frames: 2
//! Frame Time: 0.04
//! 0 90 0 0 0 0
//! 5 90 0 0 0 45
//! ";
//! let document = parse(text.as_bytes(), "turn.bvh")?;
//! let mut clip = document.to_clip();
//! assert_eq!(clip.poses[1].translations[0].x, 5.0);
//! clip.poses.reverse();
//! let backwards = Bvh::from_clip(&clip, document.channels().to_vec())?;
//! let again = parse(backwards.to_text().as_bytes(), "again.bvh")?;
//! assert_eq!(again.motion().row(0).to_vec(), [5.0, 90.0, 0.0, 0.0, 0.0, 45.0]);
//! # Ok::<(), keydance::motion::bvh::BvhError>(())
//! ```
//!
//! Of files: [`read`] and [`write`](write()). Channels for a clip that had none:
//! [`channel_layout`].

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

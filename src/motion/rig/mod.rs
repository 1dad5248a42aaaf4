//! Humanoid rigs of other programs: the dance skeleton's joints on them, and the way back.

mod names;
mod onto_rig;
mod recognise;
mod retime;

pub use onto_rig::{Rig, RigKeyframe, onto_rig};
pub use recognise::Recognised;
pub use retime::{nearest_frames, spread};

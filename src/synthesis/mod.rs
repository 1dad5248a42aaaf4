//! Synthesis: keyframes and controls become motion that can be played.
//!
//! A [`SequenceRequest`] holds keyframes, root trajectory and velocity factors; the methods of
//! [`controls`] change them; [`synthesise`] asks a model for one transition after another, fits
//! joint rotations to what it predicts, bends each transition onto its keyframe and, where asked,
//! pins the feet. A [`Dance`] is all of that from files, by whatever model.

mod blend;
pub mod clip_keyframes;
mod completion;
pub mod controls;
mod dance;
mod error;
mod foot_cleanup;
mod keyframe_choice;
pub mod keyframes;
mod knee;
mod leg;
mod motion;
mod own_frames;
mod own_rig;
pub mod regenerate;
mod request;
mod retarget;
mod seams;
mod sequence;
pub mod song;
mod song_files;
mod stand;
mod summary;
mod warning;

pub use completion::{Completion, CompletionRequest, CompletionSummary, ContactSequence, complete};
pub use dance::{Dance, DanceError, DanceRequest, DanceSummary, MadeSequence, Origin};
pub use error::SynthesisError;
pub use motion::{SynthesisedMotion, transition_motion};
pub use request::{KeyframeSource, SequenceRequest, TimedKeyframe, keyframe_of};
pub use sequence::{
    FeetOnFloor, FitError, KeyframeMiss, Sequence, SynthesisOptions, ToesOnFloor, synthesise,
    trajectory_error,
};
pub use summary::Summary;
pub use warning::{ControlWarning, Excess, control_warnings, moved_warnings};

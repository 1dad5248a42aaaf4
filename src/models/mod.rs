//! Models that fill the frames between two keyframes, behind one trait: [`TransitionModel`].
//!
//! Evaluation and synthesis know a model by this trait only.

pub mod interpolation;
pub mod transition;

pub use transition::{KeyframePose, ModelError, Transition, TransitionModel, TransitionRequest};

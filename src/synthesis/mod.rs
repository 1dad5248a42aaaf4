//! Synthesis: what a model predicted becomes motion that can be played.

mod motion;

pub use motion::{SynthesisedMotion, transition_motion};

//! What can be wrong with a request for a sequence.

use thiserror::Error;

use crate::models::ModelError;
use crate::motion::fit::RotationFitError;

/// Why there is no sequence.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SynthesisError {
    #[error("a sequence needs two keyframes or more, it has {found}")]
    TooFewKeyframes { found: usize },
    #[error("the first keyframe stands at frame {time} of the result; it must stand at frame 0")]
    FirstKeyframe { time: usize },
    #[error(
        "a keyframe at frame {time} follows one at frame {before}; keyframes need ascending frames, each once"
    )]
    Order { before: usize, time: usize },
    #[error("{clip} has no frame {frame}: its frames are 0 to {last} at {fps:.4} frames a second")]
    NoFrame {
        clip: String,
        frame: usize,
        last: usize,
        fps: f64,
    },
    /// Shapes are `(rows, columns)`.
    #[error(
        "{what} has {} rows of {} numbers; expected {} rows, one a frame, of {}",
        found.0, found.1, expected.0, expected.1
    )]
    Shape {
        what: &'static str,
        found: (usize, usize),
        expected: (usize, usize),
    },
    #[error("{keyframes} keyframes got {times} times")]
    Times { keyframes: usize, times: usize },
    #[error(
        "the keyframe of {clip} stands on another rest pose: {joint} points {degrees:.0} degrees away from where the first keyframe's does; \
         take keyframes from files with one rest pose"
    )]
    RestPose {
        clip: String,
        joint: String,
        degrees: f64,
    },
    #[error(
        "the legs of {clip} are {ratio:.3} times as long as those of the first keyframe's dancer, which is more than dancers differ; \
         declare the file's unit (--unit)"
    )]
    Size { clip: String, ratio: f64 },
    #[error("{what} is {value}; expected {expected}")]
    Value {
        what: &'static str,
        value: f64,
        expected: &'static str,
    },
    #[error("the transition from frame {from} to frame {to} of the result")]
    Transition {
        from: usize,
        to: usize,
        source: Box<ModelError>,
    },
    #[error("frame {frame} has two contacts; give each frame one, such as left:0-9,right:10-24")]
    ContactTwice { frame: usize },
    #[error("the contacts name frame {frame}; the frames of the result are 0 to {last}")]
    ContactBeyond { frame: usize, last: usize },
    #[error(
        "frame {frame} of the {frames} frames of the result has no contact; give each frame one"
    )]
    NoContact { frame: usize, frames: usize },
    #[error("{model} gave no transition for a request")]
    NoTransition { model: String },
    #[error("the frames from {from} to {to} of the result have no rotations")]
    Rotations {
        from: usize,
        to: usize,
        source: Box<RotationFitError>,
    },
}

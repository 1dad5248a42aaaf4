//! A window of a recorded clip as a request: what the evaluation gives to a model.

use ndarray::{ArrayView2, s};

use crate::models::transition::{KeyframePose, TransitionRequest};
use crate::motion::Clip;
use crate::motion::features::{ROOT_POSITION, VELOCITY_FACTORS};

/// The request for the window of `clip` from frame `start` on whose features are `window` (`[N + 1, 154]`, not standardised).
///
/// Given are the first frame k1, the last frame k2, and root positions and velocity factors of all frames. Nothing else
/// of the recorded motion goes in. `None` where the clip has no such frames.
pub fn window_request(
    clip: &Clip,
    start: usize,
    window: ArrayView2<f64>,
) -> Option<TransitionRequest> {
    let length = window.nrows().checked_sub(1)?;
    let keyframe = |frame: usize| {
        Some(KeyframePose {
            features: window.row(frame).to_owned(),
            pose: clip.poses.get(start + frame)?.clone(),
        })
    };
    Some(TransitionRequest {
        skeleton: clip.skeleton.clone(),
        start: keyframe(0)?,
        target: keyframe(length)?,
        root_trajectory: window.slice(s![.., ROOT_POSITION]).to_owned(),
        velocity_factors: window.slice(s![.., VELOCITY_FACTORS]).to_owned(),
    })
}

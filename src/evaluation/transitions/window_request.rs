//! A window of a recorded clip as a request: what the evaluation gives to a model.

use ndarray::{ArrayView2, s};

use crate::models::generator::{Given, Request};
use crate::motion::Clip;
use crate::motion::features::{ROOT_POSITION, VELOCITY_FACTORS};

/// The request for the window of `clip` from frame `start` on whose features are `window`
/// (`[N + 1, 154]`, not standardised).
///
/// Given are the first frame k1, the last frame k2, and root positions and velocity factors of all
/// frames. Nothing else of the recorded motion goes in. `None` where the clip has no such frames.
pub fn window_request(clip: &Clip, start: usize, window: ArrayView2<f64>) -> Option<Request> {
    let length = window.nrows().checked_sub(1)?;
    let given = |frame: usize| {
        Some(Given {
            frame: frame as i64,
            pose: clip.poses.get(start + frame)?.clone(),
            features: Some(window.row(frame).to_owned()),
        })
    };
    Some(Request {
        given: vec![given(0)?, given(length)?],
        root: Some(window.slice(s![.., ROOT_POSITION]).to_owned()),
        velocity_factors: Some(window.slice(s![.., VELOCITY_FACTORS]).to_owned()),
        ..Request::new(clip.skeleton.clone(), clip.frame_time, window.nrows())
    })
}

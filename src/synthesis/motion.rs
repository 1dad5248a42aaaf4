//! From predicted frames to a clip with joint rotations.

use crate::models::transition::{Transition, TransitionRequest};
use crate::motion::Clip;
use crate::motion::fit::{RotationFitError, fit_rotations};
use crate::motion::placement::world_positions;

/// A transition as a clip.
#[derive(Debug, Clone, PartialEq)]
pub struct SynthesisedMotion {
    /// Keyframe k1 as it was given, then the predicted frames: N + 1 poses on the request's
    /// skeleton.
    pub clip: Clip,
    /// Mean over predicted frames and joints of the distance from the predicted position to the
    /// clip's, cm: what is lost where predicted bones are longer or shorter than the skeleton's.
    pub mean_error: f64,
    /// The largest of these distances, cm.
    pub max_error: f64,
}

/// Turns predicted positions into a clip called `name`, `frame_time` seconds a frame.
///
/// # Errors
/// [`RotationFitError`]: no frames, or one that is not finite.
pub fn transition_motion(
    request: &TransitionRequest,
    transition: &Transition,
    name: &str,
    frame_time: f64,
) -> Result<SynthesisedMotion, RotationFitError> {
    let positions: Vec<_> = transition
        .frames
        .rows()
        .into_iter()
        .map(world_positions)
        .collect();
    let start = &request.start.pose;
    let fit = fit_rotations(
        &request.skeleton,
        &positions,
        start,
        Some(&request.target.pose),
    )?;
    let mut poses = vec![start.clone()];
    poses.extend(fit.poses);
    Ok(SynthesisedMotion {
        clip: Clip {
            name: name.into(),
            skeleton: request.skeleton.clone(),
            frame_time,
            poses,
        },
        mean_error: fit.mean_error,
        max_error: fit.max_error,
    })
}

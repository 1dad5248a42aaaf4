//! The baseline "zero velocity": the pose of keyframe k1, carried along the given root trajectory.

use ndarray::s;

use super::transitions;
use crate::models::ModelError;
use crate::models::transition::{Transition, TransitionModel, TransitionRequest};
use crate::motion::features::{BODY_POSITIONS, FACING};

/// Every frame has p^b and o^r of keyframe k1. Nothing is learned, and the target is not looked at:
/// the floor of any model.
///
/// p^r is the given trajectory. Velocities are differences of positions, and a contact label is 1
/// where the joint's squared speed in the world is below [`ZeroVelocity::contact_threshold`].
#[derive(Debug, Clone, PartialEq)]
pub struct ZeroVelocity {
    /// Squared world speed below which a foot joint counts as planted, (cm/frame)^2.
    pub contact_threshold: f64,
}

impl TransitionModel for ZeroVelocity {
    fn name(&self) -> &str {
        "zero_velocity"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        transitions(requests, self.contact_threshold, |request, _, mut row| {
            for columns in [BODY_POSITIONS, FACING] {
                let kept = request.start.features.slice(s![columns.clone()]);
                row.slice_mut(s![columns]).assign(&kept);
            }
        })
    }
}

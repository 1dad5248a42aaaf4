//! The baseline "linear positions": joint positions interpolated linearly between the keyframes, on
//! the given root trajectory.

use super::{facing_between, transitions};
use crate::models::ModelError;
use crate::models::transition::{Transition, TransitionModel, TransitionRequest};
use crate::motion::features::{BODY_POSITIONS, FACING};

/// Linear interpolation of p^b between the keyframes. Nothing is learned; bones get shorter on the
/// way.
///
/// p^r is the given trajectory. o^r goes the shorter way round. Velocities are differences of
/// positions, and a contact label is 1 where the joint's squared speed in the world is below
/// [`LinearPositions::contact_threshold`].
///
/// The last frame, k2, has p^b of the target keyframe.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearPositions {
    /// Squared world speed below which a foot joint counts as planted, (cm/frame)^2.
    pub contact_threshold: f64,
}

impl TransitionModel for LinearPositions {
    fn name(&self) -> &str {
        "linear_positions"
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        transitions(
            requests,
            self.contact_threshold,
            |request, share, mut row| {
                let (start, target) = (&request.start.features, &request.target.features);
                for column in BODY_POSITIONS {
                    row[column] = (1.0 - share) * start[column] + share * target[column];
                }
                row[FACING.start] = facing_between(request, share);
            },
        )
    }
}

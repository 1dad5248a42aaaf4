//! The baseline "zero velocity": the pose of keyframe k1, carried along the given root trajectory.

use ndarray::s;
use rayon::prelude::*;

use crate::models::ModelError;
use crate::models::transition::motion_rows::{rows_from, write_contacts};
use crate::models::transition::{Transition, TransitionModel, TransitionRequest};
use crate::motion::features::{BODY_POSITIONS, FACING, ROOT_POSITION, write_velocities};

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
        requests
            .par_iter()
            .map(|request| self.transition(request))
            .collect()
    }
}

impl ZeroVelocity {
    fn transition(&self, request: &TransitionRequest) -> Result<Transition, ModelError> {
        request.check()?;
        let start = &request.start.features;
        let mut rows = rows_from(start.view(), request.length());
        for step in 1..rows.nrows() {
            for columns in [BODY_POSITIONS, FACING] {
                rows.slice_mut(s![step, columns.clone()])
                    .assign(&start.slice(s![columns]));
            }
            rows.slice_mut(s![step, ROOT_POSITION])
                .assign(&request.root_trajectory.row(step));
        }
        write_velocities(&mut rows);
        write_contacts(&mut rows, self.contact_threshold);
        Ok(Transition {
            frames: rows.slice(s![1.., ..]).to_owned(),
        })
    }
}

//! The baseline "linear positions": joint positions interpolated linearly between the keyframes, on
//! the given root trajectory.

use ndarray::s;
use rayon::prelude::*;

use crate::models::ModelError;
use crate::models::transition::motion_rows::{rows_from, write_contacts};
use crate::models::transition::window::wrap;
use crate::models::transition::{Transition, TransitionModel, TransitionRequest};
use crate::motion::features::{BODY_POSITIONS, FACING, ROOT_POSITION, write_velocities};

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
        requests
            .par_iter()
            .map(|request| self.transition(request))
            .collect()
    }
}

impl LinearPositions {
    fn transition(&self, request: &TransitionRequest) -> Result<Transition, ModelError> {
        request.check()?;
        let length = request.length();
        let (start, target) = (&request.start.features, &request.target.features);
        let turn = wrap(target[FACING.start] - start[FACING.start]);
        let mut rows = rows_from(start.view(), length);
        for step in 1..=length {
            let share = step as f64 / length as f64;
            for column in BODY_POSITIONS {
                rows[[step, column]] = (1.0 - share) * start[column] + share * target[column];
            }
            rows.slice_mut(s![step, ROOT_POSITION])
                .assign(&request.root_trajectory.row(step));
            rows[[step, FACING.start]] = start[FACING.start] + share * turn;
        }
        write_velocities(&mut rows);
        write_contacts(&mut rows, self.contact_threshold);
        Ok(Transition {
            frames: rows.slice(s![1.., ..]).to_owned(),
        })
    }
}

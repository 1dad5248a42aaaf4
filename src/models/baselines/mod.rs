//! Models that need no training.

use ndarray::{ArrayViewMut1, s};
use rayon::prelude::*;

use super::ModelError;
use super::transition::motion_rows::{rows_from, write_contacts};
use super::transition::window::wrap;
use super::transition::{Transition, TransitionRequest};
use crate::motion::features::{FACING, ROOT_POSITION, write_velocities};

pub mod interpolation;
pub mod linear_gaussian;
pub mod linear_positions;
pub mod retrieval;
pub mod rotations;
pub mod zero_velocity;

/// The answers of a model whose frames follow from the keyframes alone.
///
/// `write` writes p^b and o^r of the frame at a share of the way from k1 to k2. p^r is the given
/// trajectory, velocities are differences of positions, and a contact label is 1 where the joint's
/// squared speed in the world is below `contact_threshold`, (cm/frame)^2.
fn transitions(
    requests: &[TransitionRequest],
    contact_threshold: f64,
    write: impl Fn(&TransitionRequest, f64, ArrayViewMut1<f64>) + Sync,
) -> Result<Vec<Transition>, ModelError> {
    let transition = |request: &TransitionRequest| {
        request.check()?;
        let length = request.length();
        let mut rows = rows_from(request.start.features.view(), length);
        for step in 1..=length {
            let mut row = rows.row_mut(step);
            let root = request.root_trajectory.row(step);
            row.slice_mut(s![ROOT_POSITION]).assign(&root);
            write(request, step as f64 / length as f64, row);
        }
        write_velocities(&mut rows);
        write_contacts(&mut rows, contact_threshold);
        Ok(Transition {
            frames: rows.slice(s![1.., ..]).to_owned(),
        })
    };
    requests.par_iter().map(transition).collect()
}

/// o^r at a share of the shorter way round from k1's to k2's, rad.
fn facing_between(request: &TransitionRequest, share: f64) -> f64 {
    let [start, target] = [&request.start, &request.target].map(|it| it.features[FACING.start]);
    start + share * wrap(target - start)
}

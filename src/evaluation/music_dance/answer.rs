//! A model's answer as poses of all frames, and as the numbers that it gave.

use glam::{DQuat, DVec3};
use ndarray::ArrayView1;

use super::request::SEED;
use crate::models::generator::Request;
use crate::models::{ModelError, Motion};
use crate::motion::fit::fit_rotations;
use crate::motion::placement::vector;
use crate::motion::rotation_6d::rotation_6d;
use crate::motion::{Pose, Skeleton};

/// What is scored of an answer.
#[derive(Debug, Clone)]
pub(super) struct Answer {
    /// Of all frames, `[F]`: the seed as it was given, then the model's rotations (those fitted to
    /// its positions where it makes none) and its root on the bones of the seed.
    pub poses: Vec<Pose>,
    raw: Option<ndarray::Array2<f64>>,
}

impl Answer {
    /// That of a motion to the request for which it was made.
    ///
    /// # Errors
    /// It is no answer to that, see [`Motion::check`]; a rotation that is none; raw numbers that
    /// are not 6 a joint and the root of every frame after the seed.
    pub fn of(request: &Request, motion: Motion) -> Result<Self, ModelError> {
        motion.check(request)?;
        let mut poses: Vec<Pose> = Vec::with_capacity(request.frames);
        let seed = request.given.iter().take(SEED);
        poses.extend(seed.map(|given| given.pose.clone()));
        let Some(like) = poses.last().filter(|_| request.frames > SEED).cloned() else {
            return Err(ModelError::NoFrames {
                rows: request.frames,
            });
        };
        let world: Vec<Vec<DVec3>> = motion
            .positions
            .outer_iter()
            .skip(SEED)
            .map(|frame| frame.rows().into_iter().map(vector).collect())
            .collect();
        let rotations: Vec<Vec<DQuat>> = match motion.poses {
            Some(poses) => poses
                .into_iter()
                .skip(SEED)
                .map(|pose| pose.rotations)
                .collect(),
            None => {
                let fit = fit_rotations(&request.skeleton, &world, &like, None);
                let fit = fit.map_err(|error| ModelError::data(&error))?;
                fit.poses.into_iter().map(|pose| pose.rotations).collect()
            }
        };
        for (rotations, world) in rotations.into_iter().zip(&world) {
            let mut pose = like.clone();
            pose.rotations = rotations.iter().map(|q| q.normalize()).collect();
            if !pose.rotations.iter().all(|q| q.is_finite()) {
                let what = "predicted rotations".into();
                return Err(ModelError::NotFinite { what });
            }
            if let (Some(root), Some(at)) = (pose.translations.first_mut(), world.first()) {
                *root = *at;
            }
            poses.push(pose);
        }
        if let Some(raw) = &motion.raw {
            check_raw(raw, request.frames - SEED, &request.skeleton)?;
        }
        let raw = motion.raw;
        Ok(Self { poses, raw })
    }

    /// The 6-D rotations of a frame after the seed as the model gave them, the root's in the world,
    /// `[6 J]`; those of its pose where it gives no raw numbers.
    pub fn given_numbers(&self, frame: usize) -> Vec<f64> {
        let pose = self.poses.get(frame);
        let numbers = pose.map_or(0, |pose| 6 * pose.rotations.len());
        // Counted from the end: a model whose seed is shorter gives more rows.
        let from_end = self.poses.len().saturating_sub(frame);
        let raw = self.raw.as_ref().and_then(|raw| {
            let row: ArrayView1<f64> = raw.row(raw.nrows().checked_sub(from_end)?);
            Some(row.iter().take(numbers).copied().collect())
        });
        raw.unwrap_or_else(|| pose.map_or(Vec::new(), numbers_of))
    }
}

/// The 6-D local rotations of a pose, `[6 J]`.
pub(super) fn numbers_of(pose: &Pose) -> Vec<f64> {
    let rotations = pose.rotations.iter();
    rotations.flat_map(|&q| rotation_6d(q)).collect()
}

fn check_raw(
    raw: &ndarray::Array2<f64>,
    frames: usize,
    skeleton: &Skeleton,
) -> Result<(), ModelError> {
    let numbers = 6 * skeleton.len() + 3;
    if raw.nrows() < frames || raw.ncols() != numbers {
        return Err(ModelError::Shape {
            what: "raw output".into(),
            expected: vec![frames, numbers],
            found: raw.shape().to_vec(),
        });
    }
    match raw.iter().all(|number| number.is_finite()) {
        true => Ok(()),
        false => Err(ModelError::NotFinite {
            what: "raw output".into(),
        }),
    }
}

//! A model's answer as poses of the missing frames.

use glam::{DQuat, DVec3};

use crate::models::generator::Request;
use crate::models::{ModelError, Motion};
use crate::motion::Pose;
use crate::motion::fit::fit_rotations;
use crate::motion::placement::vector;

/// What is scored of an answer. The two given poses are not taken from it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answer {
    /// Of the missing frames, `[F - 2]`: the model's rotations, or those fitted to its positions;
    /// its root; all other translations as at k1.
    pub poses: Vec<Pose>,
    /// Its root at k2, cm.
    pub last_root: DVec3,
}

impl Answer {
    /// That of a motion to the request for which it was made.
    ///
    /// # Errors
    /// It is no answer to that, see [`Motion::check`]; a rotation that is none.
    pub fn of(request: &Request, motion: &Motion) -> Result<Self, ModelError> {
        motion.check(request)?;
        let last = request.frames - 1;
        let world: Vec<Vec<DVec3>> = motion
            .positions
            .outer_iter()
            .map(|frame| frame.rows().into_iter().map(vector).collect())
            .collect();
        let at = |frame: usize| {
            let mut given = request.given.iter();
            given.find(|given| given.frame == frame as i64)
        };
        let (Some(start), Some(end)) = (at(0), at(last)) else {
            return Err(ModelError::NoFrames { rows: last + 1 });
        };
        let poses = match &motion.poses {
            Some(poses) => poses[1..last]
                .iter()
                .zip(&world[1..])
                .map(|(pose, world)| posed(&start.pose, &pose.rotations, world[0]))
                .collect::<Result<_, _>>()?,
            None => {
                let skeleton = &request.skeleton;
                let fit = fit_rotations(skeleton, &world[1..], &start.pose, Some(&end.pose));
                let mut poses = fit.map_err(|error| ModelError::data(&error))?.poses;
                poses.truncate(last - 1);
                poses
            }
        };
        Ok(Self {
            poses,
            last_root: world[last][0],
        })
    }
}

/// A pose of these rotations, made unit, on the bones of another.
fn posed(like: &Pose, rotations: &[DQuat], root: DVec3) -> Result<Pose, ModelError> {
    let rotations: Vec<DQuat> = rotations.iter().map(|q| q.normalize()).collect();
    if !rotations.iter().all(|q| q.is_finite()) {
        let what = "predicted rotations".into();
        return Err(ModelError::NotFinite { what });
    }
    let mut pose = like.clone();
    pose.rotations = rotations;
    pose.translations[0] = root;
    Ok(pose)
}

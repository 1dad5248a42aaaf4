//! What a model of transitions is asked for and what it gives back.

use ndarray::{Array1, Array2, ArrayView2};

use crate::models::ModelError;
use crate::models::generator::Condition;
use crate::motion::features::{FEATURES, FRAME};
use crate::motion::{JOINTS, Mapping, Pose, Skeleton};

/// One of the two keyframes of a transition.
#[derive(Debug, Clone, PartialEq)]
pub struct KeyframePose {
    /// Features of the frame, `[154]`, not standardised (cm, rad, cm/frame).
    pub features: Array1<f64>,
    /// Local translations (cm) and rotations of the same frame, `[24]`.
    pub pose: Pose,
}

/// A transition to be filled: two keyframes and the two conditions on the frames between them.
///
/// N is the number of frames from keyframe k1 to keyframe k2 (`k2 - k1`); row 0 of a condition
/// belongs to k1, row N to k2.
#[derive(Debug, Clone, PartialEq)]
pub struct TransitionRequest {
    /// The dance skeleton with the dancer's own bone lengths.
    pub skeleton: Skeleton,
    /// Keyframe k1.
    pub start: KeyframePose,
    /// Keyframe k2.
    pub target: KeyframePose,
    /// Root positions wanted, `[N + 1, 3]`, cm.
    pub root_trajectory: Array2<f64>,
    /// Velocity factors wanted, `[N + 1, 5]`, cm/frame.
    pub velocity_factors: Array2<f64>,
}

impl TransitionRequest {
    /// N, the number of frames to predict; 0 for a trajectory without rows.
    pub fn length(&self) -> usize {
        self.root_trajectory.nrows().saturating_sub(1)
    }

    /// Checks that all parts of the request fit together.
    ///
    /// # Errors
    ///
    /// [`ModelError::Skeleton`] where the skeleton is not the dance skeleton, [`ModelError::Shape`]
    /// where an array has another shape than documented, [`ModelError::NoFrames`] where N is 0,
    /// [`ModelError::NotFinite`] where a number is NaN or infinite.
    pub fn check(&self) -> Result<(), ModelError> {
        if !self.skeleton.is_dance_skeleton() {
            return Err(ModelError::Skeleton {
                joints: self.skeleton.len(),
            });
        }
        for (what, keyframe) in [("start", &self.start), ("target", &self.target)] {
            let found = keyframe.features.shape();
            if found != [FEATURES] {
                return Err(shape(format!("{what}.features"), &[FEATURES], found));
            }
            for (part, found) in [
                ("translations", keyframe.pose.translations.len()),
                ("rotations", keyframe.pose.rotations.len()),
            ] {
                if found != JOINTS {
                    let what = format!("{what}.pose.{part}");
                    return Err(shape(what, &[JOINTS], &[found]));
                }
            }
            let finite = keyframe.features.iter().all(|x| x.is_finite())
                && keyframe.pose.translations.iter().all(|x| x.is_finite())
                && keyframe.pose.rotations.iter().all(|x| x.is_finite());
            if !finite {
                return Err(ModelError::NotFinite { what: what.into() });
            }
        }
        let rows = self.root_trajectory.nrows();
        if rows < 2 {
            return Err(ModelError::NoFrames { rows });
        }
        for (what, array, columns) in [
            ("root_trajectory", &self.root_trajectory, 3),
            ("velocity_factors", &self.velocity_factors, 5),
        ] {
            if array.shape() != [rows, columns] {
                return Err(shape(what.into(), &[rows, columns], array.shape()));
            }
            if !array.iter().all(|x| x.is_finite()) {
                return Err(ModelError::NotFinite { what: what.into() });
            }
        }
        Ok(())
    }
}

fn shape(what: String, expected: &[usize], found: &[usize]) -> ModelError {
    ModelError::Shape {
        what,
        expected: expected.to_vec(),
        found: found.to_vec(),
    }
}

/// The frames a model predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// Frames k1 + 1 .. k2, `[N, 149]`: p^b, p^r, o^r, c, v^b, v^r, not standardised (cm, rad,
    /// cm/frame).
    pub frames: Array2<f64>,
}

impl Transition {
    /// Checks that these are finite numbers for `length` frames.
    ///
    /// # Errors
    ///
    /// [`ModelError::Shape`] or [`ModelError::NotFinite`].
    pub fn check(&self, length: usize) -> Result<(), ModelError> {
        check_frames(self.frames.view(), length)
    }
}

/// Checks that these are `[length, 149]` finite numbers.
///
/// # Errors
///
/// [`ModelError::Shape`] or [`ModelError::NotFinite`].
pub fn check_frames(frames: ArrayView2<f64>, length: usize) -> Result<(), ModelError> {
    if frames.shape() != [length, FRAME] {
        return Err(shape(
            "predicted frames".into(),
            &[length, FRAME],
            frames.shape(),
        ));
    }
    if !frames.iter().all(|x| x.is_finite()) {
        return Err(ModelError::NotFinite {
            what: "predicted frames".into(),
        });
    }
    Ok(())
}

/// A model that fills transitions.
pub trait TransitionModel: Send + Sync {
    /// The model's name in tables and figures, such as `whole_model`.
    fn name(&self) -> &str;

    /// What it must be given beside the two keyframes.
    fn conditions(&self) -> &'static [Condition] {
        &[Condition::RootTrajectory]
    }

    /// How it sees requests on another skeleton than the dance skeleton.
    fn mapping(&self) -> Option<&Mapping> {
        None
    }

    /// Predicts the frames k1 + 1 .. k2 of every request, in the order of the requests.
    ///
    /// The result for a request depends on that request alone, not on the others of the call;
    /// requests of one call may differ in length.
    ///
    /// # Errors
    ///
    /// [`ModelError`] for a request that does not fit together or to the model.
    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError>;
}

//! From a request to a model's numbers, and from its numbers to a dance.

use std::ops::Range;

use ndarray::{Array2, Array3, ArrayView2, Axis, s};

use super::features::DanceFeatures;
use crate::models::ModelError;
use crate::models::generator::{Motion, Request};
use crate::motion::{GroundPlace, Pose, Skeleton};

/// A request in the numbers of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct GivenDance<'r> {
    /// The seed, standardised, `[seed, D]`.
    pub motion: Array2<f32>,
    /// The music, standardised, `[F or more, A]`, frame 0 at the seed's first frame; one frame of 0
    /// where none is given.
    pub audio: Array2<f32>,
    skeleton: &'r Skeleton,
    /// The pose before frame 0, where it is given.
    before: Option<Pose>,
    seed: Vec<Pose>,
}

impl GivenDance<'_> {
    /// Refuses music that ends before frame `needed` of the dance, unless its last frame may be
    /// heard on (`padded`).
    ///
    /// # Errors
    /// It does.
    pub fn check_music(&self, model: &str, needed: usize, padded: bool) -> Result<(), ModelError> {
        let found = self.audio.nrows();
        match padded || found >= needed {
            true => Ok(()),
            false => Err(ModelError::Model {
                model: model.into(),
                reason: format!(
                    "it hears {needed} frames of music for this dance, there are {found}: end the \
                     dance earlier, or set generation.pad_audio = true"
                ),
            }),
        }
    }

    /// Some frames of the music, standardised, `[frames, A]`; behind the end its last one.
    pub fn music_at(&self, frames: Range<usize>) -> Array2<f32> {
        let last = self.audio.nrows().saturating_sub(1);
        let rows: Vec<usize> = frames.map(|frame| frame.min(last)).collect();
        self.audio.select(Axis(0), &rows)
    }

    /// What was recorded in the place of the dance, its first `frames` frames standardised,
    /// `[frames, D]`.
    ///
    /// # Errors
    /// It has no poses, fewer frames, or other joints.
    pub fn recorded(
        &self,
        features: &DanceFeatures,
        truth: &Motion,
        frames: usize,
    ) -> Result<Array2<f32>, ModelError> {
        let poses = truth.poses.as_deref().unwrap_or(&[]);
        let poses = poses.get(..frames).ok_or_else(|| ModelError::Shape {
            what: "the recorded poses".into(),
            expected: vec![frames],
            found: vec![poses.len()],
        })?;
        features.measured("the recording", self.skeleton, self.before.as_ref(), poses)
    }
}

impl DanceFeatures {
    /// A request whose poses at frames 0 to `seed` - 1 are given; a pose at frame -1 says how the
    /// first one moves, poses elsewhere are not heeded.
    ///
    /// # Errors
    /// The seed, a joint or a number of the music is missing; another frame rate than that of the
    /// training part.
    pub fn given<'r>(
        &self,
        request: &'r Request,
        seed: usize,
    ) -> Result<GivenDance<'r>, ModelError> {
        self.check_frame_time("the request", request.frame_time)?;
        let joints = request.skeleton.len();
        let pose_at = |frame: usize| {
            let given = request.given.iter().find(|it| it.frame == frame as i64);
            let given = given.ok_or_else(|| ModelError::Data {
                reason: format!("the request has no pose at frame {frame} of its seed of {seed}"),
            })?;
            let pose = &given.pose;
            match [pose.rotations.len(), pose.translations.len()] == [joints, joints] {
                true => Ok(pose.clone()),
                false => Err(ModelError::Shape {
                    what: format!("the pose at frame {frame}"),
                    expected: vec![joints, joints],
                    found: vec![pose.rotations.len(), pose.translations.len()],
                }),
            }
        };
        let poses = (0..seed).map(pose_at).collect::<Result<Vec<_>, _>>()?;
        let before = request.given.iter().find(|it| it.frame == -1);
        let before = before.map(|given| given.pose.clone());
        let skeleton = &request.skeleton;
        Ok(GivenDance {
            motion: self.measured("the request", skeleton, before.as_ref(), &poses)?,
            audio: match &request.music {
                Some(music) => self.standardised_music(music)?,
                None => Array2::zeros((1, self.audio.width())),
            },
            skeleton,
            before,
            seed: poses,
        })
    }

    /// Standardised columns of poses, `[poses, D]`: the steps of the first are those from `before`
    /// where there is one.
    fn measured(
        &self,
        what: &str,
        skeleton: &Skeleton,
        before: Option<&Pose>,
        poses: &[Pose],
    ) -> Result<Array2<f32>, ModelError> {
        let all: Vec<Pose> = before.into_iter().chain(poses).cloned().collect();
        let columns = self.columns.measure_poses(what, skeleton, &all);
        let columns = columns.map_err(|error| ModelError::data(&error))?;
        let own = columns.slice(s![all.len() - poses.len().., ..]);
        Ok(self.motion.standardise(own))
    }

    /// The seed and what follows it: standardised columns `[frames, D]` of the frames after it,
    /// which go on from where its last pose stands. [`Motion::raw`] has them in cm and rad.
    ///
    /// # Errors
    /// There are other columns than D, or no seed.
    pub fn motion(
        &self,
        given: &GivenDance<'_>,
        generated: ArrayView2<f32>,
    ) -> Result<Motion, ModelError> {
        let no_seed = || ModelError::Data {
            reason: "a dance without a seed has no pose to go on from".into(),
        };
        let width = self.columns.width();
        if generated.ncols() != width {
            return Err(ModelError::Shape {
                what: "the generated frames".into(),
                expected: vec![generated.nrows(), width],
                found: generated.shape().to_vec(),
            });
        }
        let last = given.seed.last().ok_or_else(no_seed)?;
        let raw = self.motion.restore(generated);
        let place = GroundPlace::of(last);
        let rebuilt = self
            .columns
            .poses_after(raw.view(), given.skeleton, last, place);
        let mut poses = given.seed.clone();
        poses.extend(rebuilt.map_err(|error| ModelError::data(&error))?);
        let world = given.skeleton.world_positions(&poses);
        let shape = (poses.len(), given.skeleton.len(), 3);
        let positions = Array3::from_shape_fn(shape, |(t, joint, axis)| world[t][joint][axis]);
        Ok(Motion {
            poses: Some(poses),
            raw: Some(raw),
            ..Motion::new(positions)
        })
    }
}

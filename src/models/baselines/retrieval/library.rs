//! Training clips as numbers, and the stretch of them that is nearest to poses.

use std::iter::once;

use glam::DQuat;
use ndarray::Array2;

use crate::data::Recording;
use crate::models::ModelError;
use crate::models::rotations::Body;
use crate::motion::facing::FacingJoints;
use crate::motion::rotation_6d::rotation_6d;
use crate::motion::{Pose, Skeleton};

/// Clips to look motion up in, all on one body.
pub(super) struct Library {
    body: Body,
    facing: FacingJoints,
    clips: Vec<LibraryClip>,
}

struct LibraryClip {
    poses: Vec<Pose>,
    /// What turns the body of a frame to +Z, `[frames]`.
    turns: Vec<DQuat>,
    /// 6-D rotations of all joints but the root, `[frames, 6 (J - 1)]`.
    joints: Array2<f64>,
}

/// A pose, compared with all frames.
pub(super) struct Compared {
    /// What turns its body to +Z.
    pub turn: DQuat,
    root: DQuat,
    /// Squared distance of its numbers of all joints but the root, `[clips][frames]`.
    distances: Vec<Vec<f64>>,
}

/// Frames of a clip, and what turns the body of the first one to +Z.
pub(super) struct Stretch<'l> {
    pub poses: &'l [Pose],
    pub turn: DQuat,
}

impl Library {
    /// # Errors
    /// No clip, clips of several skeletons, or one without hips and arms that could be told by
    /// their names.
    pub fn of(recordings: &[Recording]) -> Result<Self, ModelError> {
        let skeletons = recordings.iter().map(|it| (it.name(), &it.clip.skeleton));
        let body = Body::of_all(skeletons)?;
        let facing = FacingJoints::of(body.skeleton());
        let facing = facing.map_err(|error| ModelError::data(&error))?;
        let clips = recordings.iter().map(|recording| {
            let (poses, skeleton) = (&recording.clip.poses, &recording.clip.skeleton);
            let numbers = 6 * (body.joints() - 1);
            let joints: Vec<f64> = poses.iter().flat_map(numbers_of_joints).collect();
            LibraryClip {
                turns: poses
                    .iter()
                    .map(|pose| turn(&facing, skeleton, pose))
                    .collect(),
                // A pose has a rotation for each joint.
                joints: Array2::from_shape_vec((poses.len(), numbers), joints).unwrap_or_default(),
                poses: poses.clone(),
            }
        });
        Ok(Self {
            clips: clips.collect(),
            body,
            facing,
        })
    }

    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Frames of the longest clip.
    pub fn longest(&self) -> usize {
        let frames = self.clips.iter().map(|clip| clip.poses.len());
        frames.max().unwrap_or(0)
    }

    /// A pose on the bones of a skeleton with the joints of the library's.
    pub fn compare(&self, pose: &Pose, skeleton: &Skeleton) -> Compared {
        let own: Vec<f64> = numbers_of_joints(pose).collect();
        let distances = self.clips.iter().map(|clip| {
            let frames = clip.joints.rows().into_iter();
            frames.map(|row| squared_distance(row, &own)).collect()
        });
        Compared {
            turn: turn(&self.facing, skeleton, pose),
            root: pose.rotations[0],
            distances: distances.collect(),
        }
    }

    /// The stretch of `steps` steps, so a frame more, whose first frame is nearest to `first` and,
    /// where there is one, whose last frame is nearest to `last`: the sum of the squared distances
    /// of their 6 J numbers is the least, all turned so that the body of the first frame faces +Z.
    ///
    /// None where no clip is so long.
    pub fn nearest(
        &self,
        first: &Compared,
        last: Option<&Compared>,
        steps: usize,
    ) -> Option<Stretch<'_>> {
        let ends = || once((first, 0)).chain(last.map(|last| (last, steps)));
        let stretches = self.clips.iter().enumerate().flat_map(|(number, clip)| {
            let starts = 0..clip.poses.len().saturating_sub(steps);
            starts.map(move |start| {
                let distance = |(known, after): (&Compared, usize)| {
                    let root = clip.poses[start + after].rotations[0];
                    let roots = [first.turn * known.root, clip.turns[start] * root];
                    let [known_root, root] = roots.map(rotation_6d);
                    known.distances[number][start + after] + squared_distance(&known_root, &root)
                };
                (ends().map(distance).sum::<f64>(), clip, start)
            })
        });
        let (_, clip, start) = stretches.min_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
        Some(Stretch {
            poses: &clip.poses[start..=start + steps],
            turn: clip.turns[start],
        })
    }
}

/// What turns the body of a pose to +Z.
fn turn(facing: &FacingJoints, skeleton: &Skeleton, pose: &Pose) -> DQuat {
    DQuat::from_rotation_y(-facing.angle(&pose.world_positions(skeleton)))
}

fn numbers_of_joints(pose: &Pose) -> impl Iterator<Item = f64> {
    let joints = pose.rotations.iter().skip(1);
    joints.flat_map(|&rotation| rotation_6d(rotation))
}

fn squared_distance<'n>(
    a: impl IntoIterator<Item = &'n f64>,
    b: impl IntoIterator<Item = &'n f64>,
) -> f64 {
    let pairs = a.into_iter().zip(b);
    pairs.map(|(a, b)| (a - b).powi(2)).sum()
}

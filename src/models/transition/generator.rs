//! Models of transitions as what the commands ask: each is a [`Generator`].

use std::borrow::Cow;

use glam::DVec3;
use ndarray::{Array1, Array2, Array3, Axis, s};

use super::{KeyframePose, Transition, TransitionModel, TransitionRequest};
use crate::models::generator::{Given, Motion, NeededPoses, Needs, Request};
use crate::models::{Generator, ModelError};
use crate::motion::features::{CONTACTS, FACING, FRAME};
use crate::motion::placement::world_positions;
use crate::motion::{Clip, FeatureConfig, JOINTS, Mapping, PARTS, features};

/// A model of transitions is asked for motion between two poses.
impl<M: TransitionModel> Generator for M {
    fn name(&self) -> &str {
        TransitionModel::name(self)
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Ends,
            conditions: self.conditions(),
            heeds: &[],
        }
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let seen = seen(self, requests)?;
        let transitions = answers(self, &seen)?;
        let motions = requests.iter().zip(seen.iter().zip(transitions));
        motions
            .map(|(request, (seen, transition))| {
                let motion = motion(seen, transition)?;
                match Generator::mapping(self) {
                    Some(mapping) if !request.skeleton.is_dance_skeleton() => {
                        on_skeleton_of(request, motion, mapping)
                    }
                    _ => Ok(motion),
                }
            })
            .collect()
    }

    fn mapping(&self) -> Option<&Mapping> {
        TransitionModel::mapping(self)
    }

    fn raw(&self, requests: &[Request]) -> Result<Vec<Array2<f64>>, ModelError> {
        let transitions = answers(self, &seen(self, requests)?)?;
        Ok(transitions.into_iter().map(|it| it.frames).collect())
    }
}

fn answers<M: TransitionModel>(
    model: &M,
    requests: &[Request],
) -> Result<Vec<Transition>, ModelError> {
    let needs = model.needs();
    let requests: Vec<TransitionRequest> = requests
        .iter()
        .map(|request| {
            request.check(TransitionModel::name(model), &needs)?;
            TransitionRequest::of(request)
        })
        .collect::<Result<_, _>>()?;
    model.transitions(&requests)
}

/// Requests on the dance skeleton: those on another, as the model's mapping shows them.
fn seen<'r, M: TransitionModel>(
    model: &M,
    requests: &'r [Request],
) -> Result<Cow<'r, [Request]>, ModelError> {
    let Some(mapping) = TransitionModel::mapping(model) else {
        return Ok(requests.into());
    };
    let seen = requests.iter().map(|request| {
        if request.skeleton.is_dance_skeleton() {
            return Ok(request.clone());
        }
        let clip = Clip {
            name: "the request".into(),
            skeleton: request.skeleton.clone(),
            frame_time: request.frame_time,
            poses: request.given.iter().map(|it| it.pose.clone()).collect(),
        };
        let mapped = mapping.apply(&clip);
        let mapped = mapped.map_err(|error| ModelError::data(&error))?;
        let given = request.given.iter().zip(mapped.poses);
        Ok(Request {
            skeleton: mapped.skeleton,
            given: given
                .map(|(given, pose)| Given {
                    pose,
                    ..given.clone()
                })
                .collect(),
            ..request.clone()
        })
    });
    seen.collect()
}

/// A motion of the dance skeleton as one of the request's: the positions of the joints that both
/// have.
fn on_skeleton_of(
    request: &Request,
    motion: Motion,
    mapping: &Mapping,
) -> Result<Motion, ModelError> {
    let counterparts = mapping.counterparts(&request.skeleton);
    let counterparts = counterparts.map_err(|error| ModelError::data(&error))?;
    Ok(Motion {
        positions: motion.positions.select(Axis(1), &counterparts),
        ..motion
    })
}

/// The frames of a transition in the world, after the keyframe that they start from.
fn motion(request: &Request, transition: Transition) -> Result<Motion, ModelError> {
    transition.check(request.frames.saturating_sub(1))?;
    let frames = transition.frames;
    let start = TransitionRequest::of(request)?.start.features;
    let mut rows = Array2::zeros((request.frames, FRAME));
    rows.row_mut(0).assign(&start.slice(s![..FRAME]));
    rows.slice_mut(s![1.., ..]).assign(&frames);
    let mut positions = Array3::zeros((request.frames, JOINTS, 3));
    for (frame, row) in rows.rows().into_iter().enumerate() {
        for (joint, position) in world_positions(row).into_iter().enumerate() {
            for (axis, x) in DVec3::to_array(&position).into_iter().enumerate() {
                positions[[frame, joint, axis]] = x;
            }
        }
    }
    Ok(Motion {
        facing: Some(rows.column(FACING.start).to_owned()),
        contacts: Some(rows.slice(s![.., CONTACTS]).to_owned()),
        raw: Some(frames),
        ..Motion::new(positions)
    })
}

impl TransitionRequest {
    /// From what is given for F frames: the poses of frame 0 and frame F - 1, trajectory and
    /// velocity factors, zeros where none are given.
    ///
    /// # Errors
    /// A pose is missing, or cannot be measured.
    pub fn of(request: &Request) -> Result<Self, ModelError> {
        let frames = request.frames;
        let keyframe = |frame: i64| {
            let given = request.given.iter().find(|given| given.frame == frame);
            let given = given.ok_or(ModelError::NoFrames { rows: frames })?;
            let before = request.given.iter().find(|it| it.frame == frame - 1);
            Ok::<_, ModelError>(KeyframePose {
                features: match &given.features {
                    Some(features) => features.clone(),
                    None => measured(request, given, before)?,
                },
                pose: given.pose.clone(),
            })
        };
        let rows = |given: &Option<Array2<f64>>, columns: usize| {
            let zeros = || Array2::zeros((frames, columns));
            given.clone().unwrap_or_else(zeros)
        };
        Ok(Self {
            skeleton: request.skeleton.clone(),
            start: keyframe(0)?,
            target: keyframe(frames as i64 - 1)?,
            root_trajectory: rows(&request.root, 3),
            velocity_factors: rows(&request.velocity_factors, PARTS),
        })
    }
}

/// What a pose by itself tells, `[154]`: its own facing direction, and velocities from the pose
/// before where one is given.
fn measured(
    request: &Request,
    given: &Given,
    before: Option<&Given>,
) -> Result<Array1<f64>, ModelError> {
    let poses = before.into_iter().chain([given]);
    let clip = Clip {
        name: format!("the pose at frame {}", given.frame),
        skeleton: request.skeleton.clone(),
        frame_time: request.frame_time,
        poses: poses.map(|given| given.pose.clone()).collect(),
    };
    let rows =
        features(&clip, &FeatureConfig::default()).map_err(|error| ModelError::data(&error))?;
    Ok(rows.row(rows.nrows() - 1).to_owned())
}

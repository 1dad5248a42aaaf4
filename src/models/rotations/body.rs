//! The joints that a network of rotations was built for.

use glam::DVec3;
use ndarray::{ArrayD, IxDyn};

use crate::models::weights::{SavedWeights, WeightsError};
use crate::models::{ModelError, Statistics};
use crate::motion::rest_pose::{RestPose, other_rest_pose, rest_directions};
use crate::motion::{Joint, Skeleton};

const PARENTS: &str = "skeleton.parents";
const NAMES: &str = "skeleton.names";
const DIRECTIONS: &str = "skeleton.directions";

/// Names, parents and directions at rest of J joints; every dancer has bones of their own length.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// All offsets are 0.
    skeleton: Skeleton,
    /// As [`rest_directions`] gives them; empty where weights of an earlier version do not tell.
    directions: Vec<DVec3>,
}

impl Body {
    pub fn of(skeleton: &Skeleton) -> Self {
        let joints = skeleton.joints.iter().map(|joint| Joint {
            offset: DVec3::ZERO,
            end_sites: Vec::new(),
            ..joint.clone()
        });
        Self {
            skeleton: Skeleton {
                joints: joints.collect(),
            },
            directions: rest_directions(skeleton),
        }
    }

    /// The one body of all these skeletons.
    ///
    /// # Errors
    /// There is none, or two differ: which.
    pub fn of_all<'a>(
        clips: impl IntoIterator<Item = (&'a str, &'a Skeleton)>,
    ) -> Result<Self, ModelError> {
        let mut clips = clips.into_iter();
        let none = || ModelError::Data {
            reason: "there is no clip to train on".into(),
        };
        let (_, first) = clips.next().ok_or_else(none)?;
        let body = Self::of(first);
        for (name, skeleton) in clips {
            body.check(name, skeleton)?;
        }
        Ok(body)
    }

    /// J.
    pub fn joints(&self) -> usize {
        self.skeleton.len()
    }

    /// Its names and parents, with all offsets 0.
    pub fn skeleton(&self) -> &Skeleton {
        &self.skeleton
    }

    pub fn parents(&self) -> Vec<Option<usize>> {
        self.skeleton
            .joints
            .iter()
            .map(|joint| joint.parent)
            .collect()
    }

    /// Where bones point at rest; none where weights of an earlier version do not tell.
    pub fn rest_pose(&self) -> Option<RestPose<'_>> {
        (!self.directions.is_empty()).then_some(RestPose {
            skeleton: &self.skeleton,
            directions: &self.directions,
        })
    }

    /// Refuses a skeleton with other joints or another rest pose; `name` is what an error calls it.
    ///
    /// # Errors
    /// The first joint that differs.
    pub fn check(&self, name: &str, skeleton: &Skeleton) -> Result<(), ModelError> {
        let own = Self::of(skeleton);
        let (ours, theirs) = (&self.skeleton.joints, &own.skeleton.joints);
        let at = (0..ours.len().max(theirs.len())).find(|&k| ours.get(k) != theirs.get(k));
        let Some(at) = at else {
            return self.check_rest(name, &own);
        };
        let title = |joints: &[Joint]| match joints.get(at) {
            None => "no such joint".to_string(),
            Some(joint) => match joint.parent {
                Some(parent) => format!("{} on {}", joint.name, joints[parent].name),
                None => joint.name.clone(),
            },
        };
        Err(ModelError::Data {
            reason: format!(
                "{name} has another skeleton ({} joints) than the one that the model is of ({}): \
                 joint {at} is {} there, {} here; map it with data.mapping",
                theirs.len(),
                ours.len(),
                title(theirs),
                title(ours),
            ),
        })
    }

    /// Refuses another rest pose than that of the clips that the model was trained on.
    fn check_rest(&self, name: &str, other: &Self) -> Result<(), ModelError> {
        let Some((at, apart)) =
            other_rest_pose(&self.skeleton, &self.directions, &other.directions)
        else {
            return Ok(());
        };
        Err(ModelError::Data {
            reason: format!(
                "{name} has another rest pose than the clips that the model was trained on: the \
                 bone to {} points along {:.1} there, {:.1} here, {:.0} degrees apart, so that \
                 rotations mean other poses; give a file with the model's rest pose",
                self.skeleton.joints[at].name,
                other.directions[at],
                self.directions[at],
                apart.to_degrees(),
            ),
        })
    }

    /// As numbers that are saved beside the weights: parents (-1: none), the names as UTF-8 bytes
    /// with a line end after each, and directions.
    pub(in crate::models) fn statistics(&self, statistics: Statistics) -> Statistics {
        let parents = self.parents().into_iter();
        let parents: Vec<f64> = parents
            .map(|parent| parent.map_or(-1.0, |parent| parent as f64))
            .collect();
        let joints = self.skeleton.joints.iter();
        let names: String = joints.map(|joint| format!("{}\n", joint.name)).collect();
        let names: Vec<f64> = names.bytes().map(f64::from).collect();
        let statistics = statistics
            .with(PARENTS, array(parents))
            .with(NAMES, array(names));
        match self.directions.is_empty() {
            true => statistics,
            false => {
                let directions = self.directions.iter().flat_map(DVec3::to_array);
                statistics.with(DIRECTIONS, array(directions.collect()))
            }
        }
    }

    /// The body that is saved beside weights.
    ///
    /// # Errors
    /// It is not there, or is none.
    pub(in crate::models) fn saved(saved: &SavedWeights) -> Result<Self, WeightsError> {
        let refused = |problem: &str| {
            WeightsError::Refused(format!("{}: {NAMES} {problem}", saved.path.display()))
        };
        let bytes = saved.statistic_list(NAMES)?.into_iter().map(|x| x as u8);
        let names = String::from_utf8(bytes.collect()).map_err(|_| refused("is no text"))?;
        let parents = saved.statistic_list(PARENTS)?;
        if names.lines().count() != parents.len() {
            return Err(refused(
                "and skeleton.parents are of other numbers of joints",
            ));
        }
        let joints = names.lines().zip(parents).enumerate();
        let joints = joints.map(|(at, (name, parent))| {
            let parent = (parent >= 0.0).then_some(parent as usize);
            match parent.is_none_or(|parent| parent < at) {
                true => Ok(Joint {
                    name: name.into(),
                    parent,
                    offset: DVec3::ZERO,
                    end_sites: Vec::new(),
                }),
                false => Err(refused("has a joint before its parent")),
            }
        });
        let skeleton = Skeleton {
            joints: joints.collect::<Result<_, _>>()?,
        };
        let directions = match saved.has(DIRECTIONS) {
            true => saved.statistic(DIRECTIONS, &[3 * skeleton.len()])?,
            false => ArrayD::zeros(IxDyn(&[0])),
        };
        let directions: Vec<f64> = directions.into_iter().collect();
        let directions = directions.as_chunks().0.iter();
        Ok(Self {
            skeleton,
            directions: directions.map(|&axes| DVec3::from_array(axes)).collect(),
        })
    }
}

pub(super) fn array(values: Vec<f64>) -> ArrayD<f64> {
    let shape = IxDyn(&[values.len()]);
    ArrayD::from_shape_vec(shape, values).unwrap_or_default()
}

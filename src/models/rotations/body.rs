//! The joints that a network of rotations was built for.

use glam::DVec3;
use ndarray::{ArrayD, IxDyn};

use crate::models::weights::{SavedWeights, WeightsError};
use crate::models::{ModelError, Statistics};
use crate::motion::{Joint, Skeleton};

const PARENTS: &str = "skeleton.parents";
const NAMES: &str = "skeleton.names";

/// Names and parents of J joints; every dancer has bones of their own.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// All offsets are 0.
    skeleton: Skeleton,
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

    /// Refuses a skeleton with other joints; `name` is what an error calls it.
    ///
    /// # Errors
    /// The first joint that differs.
    pub fn check(&self, name: &str, skeleton: &Skeleton) -> Result<(), ModelError> {
        let own = Self::of(skeleton);
        let (ours, theirs) = (&self.skeleton.joints, &own.skeleton.joints);
        let at = (0..ours.len().max(theirs.len())).find(|&k| ours.get(k) != theirs.get(k));
        let Some(at) = at else { return Ok(()) };
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

    /// As numbers that are saved beside the weights: parents (-1: none), and the names as UTF-8
    /// bytes with a line end after each.
    pub(in crate::models) fn statistics(&self, statistics: Statistics) -> Statistics {
        let parents = self.parents().into_iter();
        let parents: Vec<f64> = parents
            .map(|parent| parent.map_or(-1.0, |parent| parent as f64))
            .collect();
        let joints = self.skeleton.joints.iter();
        let names: String = joints.map(|joint| format!("{}\n", joint.name)).collect();
        let names: Vec<f64> = names.bytes().map(f64::from).collect();
        statistics
            .with(PARENTS, array(parents))
            .with(NAMES, array(names))
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
        Ok(Self {
            skeleton: Skeleton {
                joints: joints.collect::<Result<_, _>>()?,
            },
        })
    }
}

pub(super) fn array(values: Vec<f64>) -> ArrayD<f64> {
    let shape = IxDyn(&[values.len()]);
    ArrayD::from_shape_vec(shape, values).unwrap_or_default()
}

//! Baselines of rotations on any skeleton: slerp between the keyframes, and the first one held;
//! after a seed slerp between key poses, and the seed's last pose held.

use ndarray::Array3;
use serde::{Deserialize, Serialize};
use toml::Table;

use crate::data::DataConfig;
use crate::evaluation::music_dance::PU2022;
use crate::models::generator::{Condition, Motion, NeededPoses, Needs, Request};
use crate::models::kind::{ModelKind, Paper};
use crate::models::li2023;
use crate::models::settings::ModelSettings;
use crate::models::{Generator, ModelError};
use crate::motion::Pose;

/// A baseline without weights: a line of the registry, and the model itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RotationBaseline {
    /// Each joint's rotation along the shorter arc between the keyframes around a frame, the root
    /// on a straight line: "Interpolation" of Li et al.'s table 1.
    Slerp,
    /// Pose and root of the first keyframe held: "zero velocity" of the LaFAN1 benchmark.
    HeldPose,
    /// The same as slerp between all poses that are given after a seed; the last one is held.
    KeyPoseInterpolation,
    /// Pose and root of the seed's last frame held, whatever the key poses.
    HeldSeed,
}

/// `[model]` with nothing but its kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    model: KindOnly,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct KindOnly {
    kind: RotationBaseline,
}

impl RotationBaseline {
    const ALL: [(Self, &'static str); 4] = [
        (Self::Slerp, "slerp"),
        (Self::HeldPose, "held_pose"),
        (Self::KeyPoseInterpolation, "key_pose_interpolation"),
        (Self::HeldSeed, "held_seed"),
    ];

    fn title(self) -> &'static str {
        let found = Self::ALL.iter().find(|(kind, _)| *kind == self);
        found.map_or("", |(_, name)| name)
    }
}

impl ModelKind for RotationBaseline {
    fn name(&self) -> &str {
        self.title()
    }

    fn papers(&self) -> Vec<Paper> {
        match self {
            Self::Slerp | Self::HeldPose => li2023::PAPERS.to_vec(),
            Self::KeyPoseInterpolation | Self::HeldSeed => vec![PU2022],
        }
    }

    fn defaults(&self) -> Table {
        let kind = self.title().into();
        let model = Table::from_iter([("kind".to_string(), kind)]);
        Table::from_iter([("model".to_string(), model.into())])
    }

    fn read(&self, tables: Table) -> Result<Box<dyn ModelSettings>, toml::de::Error> {
        Ok(Box::new(tables.try_into::<Settings>()?))
    }
}

impl ModelSettings for Settings {
    fn kind(&self) -> &str {
        self.model.kind.title()
    }

    fn untrained(&self, _data: &DataConfig) -> Option<Box<dyn Generator>> {
        Some(Box::new(self.model.kind))
    }
}

impl RotationBaseline {
    /// Poses of every frame, `[F]`; none without a given one.
    fn poses(self, request: &Request) -> Vec<Pose> {
        let given = request.given.iter().filter(|given| given.frame >= 0);
        let given: Vec<(f64, &Pose)> = given
            .map(|given| (given.frame as f64, &given.pose))
            .collect();
        let seed = given.iter().zip(0..request.frames);
        let seed = seed.take_while(|((at, _), frame)| *at == *frame as f64);
        let seed = seed.count();
        let pose = |frame: usize| {
            let last_of_seed = given.get(seed.checked_sub(1)?);
            let at = frame as f64;
            let next = given.partition_point(|(known, _)| *known <= at);
            let start = given.get(next.checked_sub(1)?)?;
            Some(match (self, given.get(next)) {
                (Self::HeldSeed, _) if frame >= seed => last_of_seed?.1.clone(),
                (Self::Slerp | Self::KeyPoseInterpolation, Some(target)) => {
                    let share = (at - start.0) / (target.0 - start.0);
                    start.1.towards(target.1, share)
                }
                _ => start.1.clone(),
            })
        };
        (0..request.frames).filter_map(pose).collect()
    }
}

impl Generator for RotationBaseline {
    fn name(&self) -> &str {
        self.title()
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: match self {
                Self::Slerp | Self::HeldPose => NeededPoses::Keyframes { past: 0 },
                Self::KeyPoseInterpolation | Self::HeldSeed => NeededPoses::Seed(1),
            },
            conditions: &[],
            heeds: match self {
                Self::KeyPoseInterpolation => &[Condition::KeyPoses],
                Self::Slerp | Self::HeldPose | Self::HeldSeed => &[],
            },
        }
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let motion = |request: &Request| {
            request.check(self.title(), &self.needs())?;
            if request.frames < 2 {
                return Err(ModelError::NoFrames {
                    rows: request.frames,
                });
            }
            let poses = self.poses(request);
            let world = request.skeleton.world_positions(&poses);
            let shape = (poses.len(), request.skeleton.len(), 3);
            let at = |(frame, joint, axis): (usize, usize, usize)| world[frame][joint][axis];
            Ok(Motion {
                poses: Some(poses),
                ..Motion::new(Array3::from_shape_fn(shape, at))
            })
        };
        requests.iter().map(motion).collect()
    }
}

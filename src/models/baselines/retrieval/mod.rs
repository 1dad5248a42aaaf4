//! The baseline "retrieval": between known poses the stretch of a training clip whose ends are
//! nearest to them.
//!
//! - `library`: training clips as numbers, and the search;
//! - `placed`: a stretch put where the dance is.

mod library;
mod placed;

use ndarray::Array3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::data::{DataConfig, Recording};
use crate::evaluation::music_dance::PU2022;
use crate::models::generator::{Condition, Motion, NeededPoses, Needs, Request};
use crate::models::kind::KindOf;
use crate::models::settings::{ModelSettings, ValueError};
use crate::models::{Generator, ModelError};
use crate::motion::Pose;
use library::Library;
use placed::placed;

const NAME: &str = "key_pose_retrieval";

/// The line of the registry.
pub(in crate::models) const KIND: KindOf<Settings> = KindOf::new(NAME, || vec![PU2022]);

/// Its table of a config.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(in crate::models) struct Settings {
    model: KeyPoseRetrievalConfig,
}

/// `[model]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct KeyPoseRetrievalConfig {
    /// "key_pose_retrieval".
    kind: String,
    /// Frames over which a stretch is bent onto a known pose.
    blend_frames: usize,
}

impl Default for KeyPoseRetrievalConfig {
    fn default() -> Self {
        Self {
            kind: NAME.into(),
            blend_frames: 10,
        }
    }
}

impl ModelSettings for Settings {
    fn kind(&self) -> &str {
        NAME
    }

    fn check(&self, _data: &DataConfig) -> Result<(), ValueError> {
        let frames = self.model.blend_frames;
        let (key, expected) = ("model.blend_frames", "at least 1");
        ValueError::unless(frames > 0, key, frames, expected)
    }

    fn untrained(&self, _data: &DataConfig) -> Option<Box<dyn Generator>> {
        Some(Box::new(KeyPoseRetrieval {
            blend_frames: self.model.blend_frames,
            library: None,
        }))
    }
}

/// Goes on from a seed to key pose after key pose: each time by the stretch of a training clip of
/// just so many steps whose first and last pose are nearest to those known, turned and moved so
/// that it starts where and how the dance is, and bent onto the key pose. After the last key pose
/// only the first pose counts.
///
/// Like a trained model it is told the rotations of a key pose, not where its root is: that is
/// where the stretches lead.
pub struct KeyPoseRetrieval {
    blend_frames: usize,
    /// None before [`Generator::look_up_in`].
    library: Option<Library>,
}

impl KeyPoseRetrieval {
    /// Poses of every frame, `[F]`.
    fn dance(&self, library: &Library, request: &Request) -> Result<Vec<Pose>, ModelError> {
        request.check(NAME, &self.needs())?;
        let skeleton = &request.skeleton;
        library.body().check("the request", skeleton)?;
        let frames = request.frames;
        if frames < 2 {
            return Err(ModelError::NoFrames { rows: frames });
        }
        let mut poses: Vec<Pose> = Vec::with_capacity(frames);
        let mut ends = Vec::new();
        for given in &request.given {
            let [rotations, translations] =
                [given.pose.rotations.len(), given.pose.translations.len()];
            if rotations != skeleton.len() || translations != skeleton.len() {
                return Err(ModelError::Shape {
                    what: format!("the pose at frame {}", given.frame),
                    expected: vec![skeleton.len(); 2],
                    found: vec![rotations, translations],
                });
            }
            let frame = usize::try_from(given.frame).ok();
            match frame.filter(|frame| *frame < frames) {
                Some(frame) if frame == poses.len() => poses.push(given.pose.clone()),
                Some(frame) => ends.push((frame, Some(&given.pose))),
                None => {}
            }
        }
        ends.push((frames - 1, None));
        let Some(seed_end) = poses.last() else {
            return Err(ModelError::NoFrames { rows: 0 });
        };
        let mut first = library.compare(seed_end, skeleton);
        for (end, key) in ends {
            let from = poses[poses.len() - 1].clone();
            let steps = (end + 1).saturating_sub(poses.len());
            if steps == 0 {
                continue;
            }
            let last = key.map(|key| library.compare(key, skeleton));
            let stretch = library.nearest(&first, last.as_ref(), steps);
            let stretch = stretch.ok_or_else(|| ModelError::Model {
                model: NAME.into(),
                reason: format!(
                    "no training clip has the {} frames from frame {} to frame {end}, the longest \
                     has {}; give key poses nearer to each other",
                    steps + 1,
                    poses.len() - 1,
                    library.longest()
                ),
            })?;
            let turn = first.turn.inverse() * stretch.turn;
            let made = placed(stretch.poses, turn, &from, key, self.blend_frames);
            poses.extend(made);
            if let Some(last) = last {
                first = last;
            }
        }
        Ok(poses)
    }
}

impl Generator for KeyPoseRetrieval {
    fn name(&self) -> &str {
        NAME
    }

    fn needs(&self) -> Needs {
        Needs {
            poses: NeededPoses::Seed(1),
            conditions: &[],
            heeds: &[Condition::KeyPoses],
        }
    }

    fn look_up_in(&mut self, training: &[Recording]) -> Result<(), ModelError> {
        self.library = Some(Library::of(training)?);
        Ok(())
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        let library = self.library.as_ref().ok_or_else(|| ModelError::Missing {
            model: NAME.into(),
            what: "training clips to look motion up in; give their folder with --data".into(),
        })?;
        let motion = |request: &Request| {
            let poses = self.dance(library, request)?;
            let world = request.skeleton.world_positions(&poses);
            let shape = (poses.len(), request.skeleton.len(), 3);
            let at = |(frame, joint, axis): (usize, usize, usize)| world[frame][joint][axis];
            Ok(Motion {
                poses: Some(poses),
                ..Motion::new(Array3::from_shape_fn(shape, at))
            })
        };
        requests.par_iter().map(motion).collect()
    }
}

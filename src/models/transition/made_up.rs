//! Made-up windows, for timings: the very step that a training runs, on numbers that mean nothing.

use std::iter;

use glam::{DQuat, DVec3};
use ndarray::Array2;
use rand::{RngExt as _, SeedableRng as _};

use super::settings::TransitionSettings;
use super::single_frames;
use super::task::{StepPlan, TransitionStep};
use super::training_windows::TrainingWindows;
use super::{DanceClip, Forcing, Network, RootFrame, Standardisation, Window};
use crate::autograd::Parameters;
use crate::models::settings::InitialRng;
use crate::models::{Generator, ModelError, Statistics, Step, Streams, Task};
use crate::motion::features::FEATURES;
use crate::motion::{Clip, JOINTS, Pose, Skeleton};
use crate::nn::Initialiser;

/// One step without end: own predictions fed back, dropout on.
pub(super) struct MadeUpTask {
    network: std::sync::Arc<dyn Network<f32>>,
    windows: TrainingWindows,
    plan: StepPlan,
    shards: usize,
}

impl MadeUpTask {
    /// Steps on `batch` windows of `frames` + 1 frames.
    ///
    /// # Errors
    /// A model that is not trained.
    pub fn new(
        settings: &TransitionSettings,
        frames: usize,
        batch: usize,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Self, ModelError> {
        let mut rng = InitialRng::seed_from_u64(streams.seed());
        let features = Array2::from_shape_simple_fn((frames + batch, FEATURES), || {
            rng.random_range(-1.0..1.0)
        });
        let poses = iter::repeat_with(|| Pose {
            translations: vec![DVec3::Y; JOINTS],
            rotations: (0..JOINTS)
                .map(|_| DQuat::from_rotation_x(rng.random_range(-1.0..1.0)))
                .collect(),
        });
        let clip = Clip {
            name: "made up".into(),
            skeleton: Skeleton { joints: Vec::new() },
            frame_time: 1.0 / 30.0,
            poses: poses.take(features.nrows()).collect(),
        };
        let standardisation = Standardisation::fit([features.view()]);
        let network = settings.model.build(init, &standardisation)?;
        let single_frames = single_frames::draw(
            &[features.nrows()],
            network.single_frames(),
            &mut streams.stream("single_frames", &[0]),
        );
        Ok(Self {
            network: network.into(),
            plan: StepPlan {
                single_frames,
                length: frames,
                windows: (0..batch).map(|start| Window { clip: 0, start }).collect(),
            },
            windows: TrainingWindows {
                clips: vec![DanceClip {
                    name: clip.name.clone(),
                    features,
                    clip,
                }],
                standardisation,
                root_frame: RootFrame::World,
                mapping: None,
            },
            shards: settings.schedule.shards,
        })
    }
}

impl Task<f32> for MadeUpTask {
    fn steps(&self) -> u64 {
        u64::MAX
    }

    fn frame_steps(&self) -> u64 {
        u64::MAX
    }

    fn step(&self, _step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(TransitionStep {
            network: &*self.network,
            windows: &self.windows,
            shards: self.shards,
            plan: self.plan.clone(),
            forcing: Forcing::FreeRunning,
            epoch: 0,
            beta: 0.0,
        })
    }

    fn rate_group(&self, parameter: &str) -> Option<&str> {
        self.network.rate_group(parameter)
    }

    fn statistics(&self) -> Statistics {
        self.windows.standardisation.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        self.windows.model(name, &self.network, parameters)
    }
}

//! Made-up windows, for timings: the very step that a training runs, on numbers that mean nothing.

use std::borrow::Cow;
use std::iter;

use glam::{DQuat, DVec3};
use rand::{RngExt as _, SeedableRng as _};

use super::augmentation::Augmentation;
use super::settings::TransitionSettings;
use super::single_frames;
use super::task::{StepPlan, TransitionStep};
use super::training_clips::TrainingClips;
use super::training_windows::TrainingWindows;
use super::{Forcing, Network, RootFrame, Standardisation, Window};
use crate::autograd::Parameters;
use crate::data::{ClipSource, DataError};
use crate::models::scratch::Scratch;
use crate::models::settings::InitialRng;
use crate::models::{AugmentationConfig, Generator, ModelError, Statistics, Step, Streams, Task};
use crate::motion::{
    Clip, DANCE_JOINTS, DANCE_PARENTS, FeatureConfig, JOINTS, Joint, Pose, Skeleton,
};
use crate::nn::Initialiser;

/// Frames of a transition where none are given.
pub(crate) const MADE_UP_FRAMES: usize = 30;

/// One step without end: own predictions fed back, dropout on.
pub(super) struct MadeUpTask {
    network: std::sync::Arc<dyn Network<f32>>,
    windows: TrainingWindows<'static>,
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
        let poses = iter::repeat_with(|| Pose {
            translations: vec![DVec3::Y; JOINTS],
            rotations: (0..JOINTS)
                .map(|_| DQuat::from_rotation_x(rng.random_range(-1.0..1.0)))
                .collect(),
        });
        let joints = DANCE_JOINTS.iter().zip(DANCE_PARENTS);
        let joints = joints.map(|(name, parent)| Joint {
            name: (*name).into(),
            parent,
            offset: DVec3::Y,
            end_sites: Vec::new(),
        });
        let clip = Clip {
            name: "made up".into(),
            skeleton: Skeleton {
                joints: joints.collect(),
            },
            frame_time: 1.0 / 30.0,
            poses: poses.take(frames + batch).collect(),
        };
        let recorded = Augmentation::new(1, &AugmentationConfig::default()).forms();
        let clip = ClipSource::Held(Cow::Owned(clip));
        let unreadable = |error: DataError| ModelError::data(&error);
        let clips = TrainingClips::new(
            vec![clip],
            &recorded,
            FeatureConfig::default(),
            Scratch::new(),
        );
        let clips = clips.map_err(unreadable)?;
        let standardisation = Standardisation::fit_visited(|visit| clips.each(0..1, visit));
        let standardisation = standardisation.map_err(unreadable)?;
        let network = settings.model.build(init, &standardisation)?;
        let single_frames = single_frames::draw(
            &[frames + batch],
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
                clips,
                standardisation,
                root_frame: RootFrame::World,
                mapping: None,
            },
            shards: settings.schedule.shards_of(batch),
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

//! What a config says of a model of rotations, and what all of them do with it.

use std::fmt::Debug;

use rand::Rng;
use serde::Serialize;

use super::exported_batch;
use super::gradient_check;
use super::made_up::MadeUpTask;
use super::task::RotationTask;
use super::trained::{Reference, TrainedRotations};
use super::{Body, RotationNetwork, ScheduleConfig, WindowStatistics};
use crate::autograd::check::CheckReport;
use crate::autograd::{Parameters, Real};
use crate::data::DataConfig;
use crate::models::exported_batch::{ExportOptions, ExportedBatch};
use crate::models::settings::{
    GradientCheckOptions, InitialRng, LoadError, ModelSettings, TaskSetting, ValueError,
};
use crate::models::transition::{MADE_UP_FRAMES, RootFrame};
use crate::models::weights::SavedWeights;
use crate::models::{AugmentationConfig, Generator, ModelError, Statistics, Streams, Task};
use crate::motion::ContactRule;
use crate::nn::Initialiser;

/// The tables of a model of rotations; each is a [`ModelSettings`] through that.
pub trait RotationSettings: Serialize + Clone + Debug + Send + Sync + 'static {
    /// Its name in a config.
    const KIND: &'static str;
    /// Keys that act after the network.
    const AFTER_THE_NETWORK: &'static [&'static str] = &[];

    fn schedule(&self) -> &ScheduleConfig;

    fn augmentation(&self) -> &AugmentationConfig;

    fn root_frame(&self) -> RootFrame;

    /// How recorded frames are labelled.
    fn contact_rule(&self) -> ContactRule;

    /// Frames before the first keyframe that are given.
    fn past(&self) -> usize {
        0
    }

    /// Checks the values that are its own.
    ///
    /// # Errors
    /// The first out of its range, or that does not fit the data's.
    fn check_own(&self, data: &DataConfig) -> Result<(), ValueError>;

    /// The network, its weights added through `init`.
    ///
    /// # Errors
    /// Sizes that do not fit together.
    fn network<T: Real, R: Rng>(
        &self,
        init: &mut Initialiser<'_, T, R>,
        body: &Body,
        statistics: &WindowStatistics,
    ) -> Result<Box<dyn RotationNetwork<T>>, ModelError>;

    /// The same structure in small sizes, for checks in f64.
    fn small(&self) -> Self;
}

/// [`RotationSettings::network`] within the limit of weights.
pub(super) fn build<S: RotationSettings, T: Real, R: Rng>(
    settings: &S,
    init: &mut Initialiser<'_, T, R>,
    body: &Body,
    statistics: &WindowStatistics,
) -> Result<Box<dyn RotationNetwork<T>>, ModelError> {
    let network = settings.network(init, body, statistics)?;
    match init.exceeded() {
        None => Ok(network),
        Some(most) => Err(ModelError::TooLarge { most }),
    }
}

/// A network with its saved weights.
pub(super) struct Loaded {
    pub body: Body,
    pub statistics: WindowStatistics,
    pub network: Box<dyn RotationNetwork<f32>>,
    pub parameters: Parameters<f32>,
}

/// # Errors
/// The weights are those of another model.
pub(super) fn loaded<S: RotationSettings>(
    settings: &S,
    saved: &SavedWeights,
) -> Result<Loaded, LoadError> {
    let body = Body::saved(saved)?;
    let statistics = WindowStatistics::saved(saved, &body)?;
    let known = statistics.statistics(body.statistics(Statistics::default()));
    let (network, parameters) =
        saved.network(&known, |init| build(settings, init, &body, &statistics))?;
    Ok(Loaded {
        body,
        statistics,
        network,
        parameters,
    })
}

impl<S: RotationSettings> ModelSettings for S {
    fn kind(&self) -> &str {
        S::KIND
    }

    fn check(&self, data: &DataConfig) -> Result<(), ValueError> {
        self.schedule().check()?;
        self.augmentation().check()?;
        self.check_own(data)
    }

    fn budget_note(&self) -> String {
        self.schedule().budget()
    }

    fn keys_after_the_network(&self) -> &'static [&'static str] {
        S::AFTER_THE_NETWORK
    }

    fn task<'d>(
        &self,
        setting: &TaskSetting<'d>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        let build = |body: &_, statistics: &_| build(self, init, body, statistics);
        Ok(Box::new(RotationTask::new(self, setting, build)?))
    }

    fn reads_stored_clips(&self) -> bool {
        true
    }

    fn made_up_task(
        &self,
        frames: Option<usize>,
        batch: usize,
        streams: Streams,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32>>, ModelError> {
        let frames = frames.unwrap_or(MADE_UP_FRAMES);
        Ok(Box::new(MadeUpTask::new(
            self, frames, batch, streams, init,
        )?))
    }

    fn trained(&self, name: &str, saved: &SavedWeights) -> Result<Box<dyn Generator>, LoadError> {
        let model = loaded(self, saved)?;
        let reference = Reference::new(model.body, self)?;
        let trained =
            TrainedRotations::new(name, model.network.into(), model.parameters, reference);
        Ok(Box::new(trained))
    }

    fn export_batch(
        &self,
        saved: &SavedWeights,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        exported_batch::export(self, saved, setting, options)
    }

    fn check_gradients(
        &self,
        options: &GradientCheckOptions,
    ) -> Result<Vec<(String, CheckReport)>, ModelError> {
        match options.full_size {
            true => gradient_check::check_all(self, options),
            false => gradient_check::check_all(&self.small(), options),
        }
    }
}

//! What a config says of a transition model beside what all experiments have. The defaults are
//! those of Pan et al. 2021.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::exported_batch;
use super::gradient_check::{self, GradientCheckError};
use super::made_up::{MADE_UP_FRAMES, MadeUpTask};
use super::task::TransitionTask;
use super::{DanceClip, ModelConfig, Standardisation, TrainedModel};
use crate::autograd::check::CheckReport;
use crate::data::{ClipSource, DataConfig};
use crate::experiment::ExperimentConfig;
use crate::models::exported_batch::{ExportOptions, ExportedBatch};
use crate::models::settings::{
    GradientCheckOptions, InitialRng, LoadError, ModelSettings, TaskSetting, ValueError,
};
use crate::models::weights::SavedWeights;
use crate::models::{AugmentationConfig, Generator, ModelError, Shards, Streams, Task};
use crate::nn::Initialiser;

/// Longest transition that a schedule may name, frames.
const LONGEST: usize = 10_000;
/// Most windows that a batch may have.
const LARGEST_BATCH: usize = 65_536;

/// The tables of a config that belong to a transition model.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TransitionSettings {
    pub model: ModelConfig,
    pub schedule: ScheduleConfig,
    /// The data's statistics are over the clips and their mirror images, without other tempi.
    pub augmentation: AugmentationConfig,
    pub scheduled_sampling: ScheduledSamplingConfig,
}

/// The curriculum: in epoch e (from 0) every transition length from `min(min_len + min_len_step
/// floor(e / min_len_every), max_len)` to `min(min_len + max_len_step e, max_len)` frames.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    /// Shortest and longest transition of the first epoch, frames.
    pub min_len: usize,
    /// Longest transition of the last epoch, frames.
    pub max_len: usize,
    /// How much the longest transition grows from one epoch to the next, frames.
    pub max_len_step: usize,
    /// How much the shortest transition grows every `min_len_every` epochs, frames.
    pub min_len_step: usize,
    /// Epochs until the shortest transition grows again.
    pub min_len_every: usize,
    /// Most windows in a batch.
    pub batch_size: usize,
    /// Parts that a batch is computed in.
    pub shards: Shards,
    /// Share of the schedule that is trained, above 0 and at most 1: random windows of the lengths
    /// of every epoch, below 1 in whole batches, see [`super::Schedule::new`].
    pub fraction: f64,
    /// In place of `fraction`: about how many frames are trained, of however many clips; the whole
    /// schedule where it has no more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_steps: Option<u64>,
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            min_len: 5,
            max_len: 70,
            max_len_step: 1,
            min_len_step: 4,
            min_len_every: 5,
            batch_size: 128,
            shards: Shards::default(),
            fraction: 1.0,
            frame_steps: None,
        }
    }
}

/// Scheduled sampling: one draw a batch, ground truth is fed with probability beta.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduledSamplingConfig {
    /// Factor of beta from one step of the whole schedule to the next, above 0 and at most 1; see
    /// [`super::Schedule::teacher_forcing`].
    pub decay: f64,
}

impl Default for ScheduledSamplingConfig {
    fn default() -> Self {
        Self { decay: 0.99995 }
    }
}

impl ModelSettings for TransitionSettings {
    fn kind(&self) -> &str {
        self.model.kind()
    }

    fn check(&self, data: &DataConfig) -> Result<(), ValueError> {
        self.schedule.check()?;
        let decay = self.scheduled_sampling.decay;
        ValueError::unless(is_share(decay), "scheduled_sampling.decay", decay, SHARE)?;
        self.augmentation.check()?;
        self.model.check(data)
    }

    fn budget_note(&self) -> String {
        let schedule = &self.schedule;
        format!("{}, batch size {}", schedule.budget(), schedule.batch_size)
    }

    fn rate_groups(&self) -> &'static [&'static str] {
        self.model.rate_groups()
    }

    fn keys_after_the_network(&self) -> &'static [&'static str] {
        &["model.velocity_refinement"]
    }

    fn task<'d>(
        &self,
        setting: &TaskSetting<'d>,
        init: &mut Initialiser<'_, f32, InitialRng>,
    ) -> Result<Box<dyn Task<f32> + 'd>, ModelError> {
        let clips = self.clips(setting)?;
        let task = TransitionTask::new(self, setting, clips, |statistics| {
            self.model.build(init, statistics)
        })?;
        Ok(Box::new(task))
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
        Ok(Box::new(self.load(name, saved)?))
    }

    fn untrained(&self, data: &DataConfig) -> Option<Box<dyn Generator>> {
        self.model.untrained(data.contact_threshold)
    }

    fn check_gradients(
        &self,
        options: &GradientCheckOptions,
    ) -> Result<Vec<(String, CheckReport)>, ModelError> {
        let model = match options.full_size {
            true => self.model.clone(),
            false => self.model.small(),
        };
        gradient_check::check_all(&model, options).map_err(|error| match error {
            GradientCheckError::Model(error) => error,
            other => ModelError::data(&other),
        })
    }

    fn export_batch(
        &self,
        saved: &SavedWeights,
        setting: &TaskSetting<'_>,
        options: &ExportOptions,
    ) -> Result<ExportedBatch, LoadError> {
        let model = self.load(self.kind(), saved)?;
        let measure = |clip: ClipSource<'_>| {
            let clip = clip.whole().map_err(|error| ModelError::data(&error))?;
            let measured = DanceClip::measure(clip.into_owned(), &setting.data.features());
            measured.map_err(|error| ModelError::data(&error))
        };
        let clips: Vec<_> = self.clips(setting)?.into_iter().map(measure).collect();
        let clips = clips.into_iter().collect::<Result<Vec<_>, _>>()?;
        let root_frame = self.model.root_frame();
        Ok(exported_batch::export(&model, root_frame, &clips, options)?)
    }
}

impl TransitionSettings {
    /// Those of an experiment, where its model is one of transitions.
    pub fn of(config: &ExperimentConfig) -> Option<&Self> {
        config.model.downcast_ref()
    }

    /// The same, to be changed.
    pub fn of_mut(config: &mut ExperimentConfig) -> Option<&mut Self> {
        config.model.downcast_mut()
    }

    /// The network with saved weights.
    ///
    /// # Errors
    /// The weights are those of another model.
    pub fn load(&self, name: &str, saved: &SavedWeights) -> Result<TrainedModel, LoadError> {
        let standardisation = Standardisation::saved(saved)?;
        let (network, parameters) = saved.network(&standardisation.statistics(), |init| {
            self.model.build(init, &standardisation)
        })?;
        let root_frame = self.model.root_frame();
        Ok(TrainedModel::new(
            name.into(),
            network,
            parameters,
            standardisation,
            root_frame,
        )
        .refining_velocities(self.model.refines_velocities())
        .seeing_through(self.model.mapping().cloned()))
    }

    /// The training clips as the model sees them.
    fn clips<'d>(&self, setting: &TaskSetting<'d>) -> Result<Vec<ClipSource<'d>>, ModelError> {
        let clips = setting.dataset.training_clips();
        let Some(mapping) = self.model.mapping() else {
            return Ok(clips);
        };
        let mapped = |clip: ClipSource<'_>| {
            let clip = clip.whole().map_err(|error| ModelError::data(&error))?;
            let mapped = mapping.apply(&clip);
            let mapped = mapped.map_err(|error| ModelError::data(&error))?;
            Ok(ClipSource::Held(Cow::Owned(mapped)))
        };
        clips.into_iter().map(mapped).collect()
    }
}

const SHARE: &str = "above 0 and at most 1";

fn is_share(x: f64) -> bool {
    x > 0.0 && x <= 1.0
}

/// Least windows in a shard that are hardly slower than more: a product over the windows of a
/// frame.
const WORTHWHILE: usize = 32;

impl ScheduleConfig {
    /// Shards of a batch of `windows`.
    pub(super) fn shards_of(&self, windows: usize) -> usize {
        self.shards.count(windows, WORTHWHILE)
    }

    fn check(&self) -> Result<(), ValueError> {
        for (key, value, least, most) in [
            ("min_len", self.min_len, 1, LONGEST),
            ("max_len", self.max_len, self.min_len, LONGEST),
            ("max_len_step", self.max_len_step, 1, LONGEST),
            ("min_len_step", self.min_len_step, 0, LONGEST),
            ("min_len_every", self.min_len_every, 1, LONGEST),
            ("batch_size", self.batch_size, 1, LARGEST_BATCH),
        ] {
            let expected = format!("a whole number from {least} to {most}");
            let valid = (least..=most).contains(&value);
            ValueError::unless(valid, format!("schedule.{key}"), value, expected)?;
        }
        self.shards.check(self.batch_size)?;
        let fraction = self.fraction;
        ValueError::unless(is_share(fraction), "schedule.fraction", fraction, SHARE)?;
        let Some(frame_steps) = self.frame_steps else {
            return Ok(());
        };
        let key = "schedule.frame_steps";
        ValueError::unless(frame_steps > 0, key, frame_steps, "at least 1")?;
        let expected = format!(
            "one of the two, not schedule.fraction = {fraction} beside it; schedule.fraction = 1 \
             leaves it to {key}"
        );
        ValueError::unless(fraction == 1.0, key, frame_steps, expected)
    }

    /// The key that says how much of the schedule is trained.
    pub(super) fn budget_key(&self) -> &'static str {
        match self.frame_steps {
            Some(_) => "schedule.frame_steps",
            None => "schedule.fraction",
        }
    }

    /// The same with its value, for a message or a caption.
    pub(super) fn budget(&self) -> String {
        let key = self.budget_key();
        match self.frame_steps {
            Some(frame_steps) => format!("{key} {frame_steps}"),
            None => format!("{key} {}", self.fraction),
        }
    }
}

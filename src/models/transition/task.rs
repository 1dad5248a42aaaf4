//! The training of a transition network: a curriculum of windows, scheduled sampling, single frames
//! beside them.

use std::sync::{Arc, Mutex, PoisonError};

use rand::RngExt as _;
use serde_json::{Map, Value, json};

use super::augmentation::Augmentation;
use super::schedule::parts;
use super::settings::{ScheduledSamplingConfig, TransitionSettings};
use super::single_frames::{self, SingleFramePlan};
use super::training_clips::TrainingClips;
use super::training_windows::TrainingWindows;
use super::{Batch, BatchPlan, DataRanges, Forcing, Network, Schedule, Standardisation, Window};
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::data::{ClipSource, DataError};
use crate::models::scratch::Scratch;
use crate::models::settings::TaskSetting;
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};

/// The training of a network on the windows of clips.
pub struct TransitionTask<'d> {
    network: Arc<dyn Network<f32>>,
    windows: TrainingWindows<'d>,
    augmentation: Augmentation,
    /// Frames of the clips in all their forms.
    form_frames: Vec<usize>,
    schedule: Schedule,
    scheduled_sampling: ScheduledSamplingConfig,
    shards: usize,
    streams: Streams,
    ranges: Option<DataRanges>,
    /// The batches of the epoch that was asked for last.
    epoch: Mutex<Option<(usize, Arc<Vec<BatchPlan>>)>>,
}

impl<'d> TransitionTask<'d> {
    /// The training of the network that `build` makes from the statistics of the training clips.
    ///
    /// # Errors
    /// Clips that are too short for the schedule or cannot be measured in another form; a network
    /// that cannot be built.
    pub fn new(
        settings: &TransitionSettings,
        setting: &TaskSetting<'_>,
        clips: Vec<ClipSource<'d>>,
        build: impl FnOnce(&Standardisation) -> Result<Box<dyn Network<f32>>, ModelError>,
    ) -> Result<Self, ModelError> {
        let frames: Vec<usize> = clips.iter().map(ClipSource::frames).collect();
        let augmentation = Augmentation::new(clips.len(), &settings.augmentation);
        let unreadable = |error: DataError| ModelError::data(&error);
        let forms = augmentation.forms();
        let clips = TrainingClips::new(clips, &forms, setting.data.features(), Scratch::new());
        let clips = clips.map_err(unreadable)?;
        let schedule = Schedule::new(&frames, &settings.schedule, setting.streams);
        let longest = frames.iter().copied().max().unwrap_or(0);
        if schedule.steps() == 0 {
            return Err(ModelError::Data {
                reason: format!(
                    "the schedule has no step: no window of {} to {} frames at {} of {}, the longest of {}; raise \
                     {}, or lower schedule.batch_size or schedule.min_len",
                    settings.schedule.min_len,
                    settings.schedule.max_len,
                    settings.schedule.budget(),
                    counted(frames.len(), "training clip"),
                    counted(longest, "frame"),
                    settings.schedule.budget_key(),
                ),
            });
        }
        let root_frame = settings.model.root_frame();
        // Of the longest transitions that are trained.
        let transition = settings.schedule.max_len.min(longest.saturating_sub(1));
        let measured = 0..augmentation.at_recorded_tempo();
        let standardisation = root_frame
            .standardisation_of(transition, |visit| clips.each(measured.clone(), visit))
            .map_err(unreadable)?;
        let ranges = DataRanges::of_frames(frames.iter().sum(), |visit| {
            clips.each(0..frames.len(), visit)
        });
        Ok(Self {
            network: build(&standardisation)?.into(),
            form_frames: clips.frames(),
            windows: TrainingWindows {
                clips,
                standardisation,
                root_frame,
                mapping: settings.model.mapping().cloned(),
            },
            augmentation,
            schedule,
            scheduled_sampling: settings.scheduled_sampling.clone(),
            shards: settings.schedule.shards_of(settings.schedule.batch_size),
            streams: setting.streams,
            ranges: ranges.map_err(unreadable)?,
            epoch: Mutex::new(None),
        })
    }

    fn batches(&self, epoch: usize) -> Arc<Vec<BatchPlan>> {
        let mut kept = self.epoch.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some((of, batches)) if *of == epoch => batches.clone(),
            _ => {
                let batches = Arc::new(self.schedule.epoch(epoch));
                *kept = Some((epoch, batches.clone()));
                batches
            }
        }
    }

    /// A batch of the schedule with the single frames of its step, all these windows in a form that
    /// `[augmentation]` allows.
    fn plan(&self, batch: &BatchPlan, step: u64) -> StepPlan {
        let count = self.network.single_frames();
        let mut plan = StepPlan {
            length: batch.length,
            windows: batch.windows.clone(),
            single_frames: single_frames::draw(
                self.schedule.clip_frames(),
                count,
                &mut self.streams.stream("single_frames", &[step]),
            ),
        };
        self.augmentation
            .vary(&mut plan, &self.form_frames, &self.streams, step);
        plan
    }
}

impl Task<f32> for TransitionTask<'_> {
    fn steps(&self) -> u64 {
        self.schedule.steps()
    }

    fn frame_steps(&self) -> u64 {
        self.schedule.frame_steps()
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        let (epoch, position) = self.schedule.place(step);
        let batches = self.batches(epoch);
        let plan = self.plan(&batches[position], step);
        let beta = self
            .schedule
            .teacher_forcing(&self.scheduled_sampling, step);
        let mut sampling = self.streams.stream("sampling", &[step]);
        let drawn = match sampling.random::<f64>() < beta {
            true => Forcing::Teacher,
            false => Forcing::FreeRunning,
        };
        Box::new(TransitionStep {
            network: &*self.network,
            windows: &self.windows,
            shards: self.shards,
            plan,
            forcing: self.network.forcing(drawn),
            epoch,
            beta,
        })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        let (epoch, position) = self.schedule.place(step);
        [epoch as u64, position as u64]
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

    fn summary(&self) -> Option<String> {
        Some(counted(self.schedule.epochs(), "epoch"))
    }

    fn warnings(&self) -> Vec<String> {
        let skipped = self.schedule.skipped_lengths();
        let ends = skipped.first().zip(skipped.last());
        let warning = ends.map(|(first, last)| {
            let lengths = match first == last {
                true => counted(*first, "frame"),
                false => format!("{first} to {last} frames"),
            };
            format!("no training clip is long enough for transitions of {lengths}: skipped")
        });
        warning.into_iter().collect()
    }

    fn facts(&self) -> Map<String, Value> {
        let mut facts = Map::new();
        let whole = self.schedule.whole_frame_steps();
        facts.insert("whole_schedule_frame_steps".into(), json!(whole));
        if let Some(ranges) = self.ranges {
            facts.insert("data_ranges".into(), json!(ranges));
        }
        facts
    }
}

/// What a step trains.
#[derive(Debug, Clone)]
pub(super) struct StepPlan {
    /// N of the windows.
    pub length: usize,
    pub windows: Vec<Window>,
    pub single_frames: Vec<SingleFramePlan>,
}

/// A step of the training.
pub(super) struct TransitionStep<'t> {
    pub network: &'t dyn Network<f32>,
    pub windows: &'t TrainingWindows<'t>,
    pub shards: usize,
    pub plan: StepPlan,
    pub forcing: Forcing,
    pub epoch: usize,
    /// Probability of the ground truth at this step.
    pub beta: f64,
}

impl Step<f32> for TransitionStep<'_> {
    fn shards(&self) -> usize {
        self.shards.min(self.plan.windows.len())
    }

    fn frames(&self) -> u64 {
        (self.plan.windows.len() * self.plan.length) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let StepPlan {
            length,
            windows,
            single_frames,
        } = &self.plan;
        let of_shard = |len: usize| parts(len, self.shards()).nth(shard).unwrap_or(0..0);
        let shard_windows = &windows[of_shard(windows.len())];
        let unreadable = |error: DataError| AutogradError::Input(error.to_string());
        let (features, poses) = self
            .windows
            .cut(shard_windows, *length, self.network.reads_poses())
            .map_err(unreadable)?;
        let single_frames_of_shard = &single_frames[of_shard(single_frames.len())];
        let batch = Batch {
            features,
            poses,
            total_windows: windows.len(),
            single_frames: self
                .windows
                .single_frames(single_frames_of_shard)
                .map_err(unreadable)?,
            total_single_frames: single_frames.len(),
        };
        self.network.losses(tape, &batch, self.forcing)
    }

    fn columns(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("epoch", json!(self.epoch)),
            ("length", json!(self.plan.length)),
            ("batch", json!(self.plan.windows.len())),
            ("teacher_forcing", json!(self.forcing == Forcing::Teacher)),
            ("beta", json!(self.beta)),
        ]
    }

    fn describe(&self) -> String {
        format!(
            "{} of {}",
            counted(self.plan.windows.len(), "window"),
            counted(self.plan.length, "frame")
        )
    }
}

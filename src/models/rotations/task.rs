//! The training of a network of rotations: epochs over all windows, one length a batch.

use std::sync::{Arc, Mutex, PoisonError};

use serde_json::{Map, Value, json};

use super::clips::Forms;
use super::schedule::{BatchPlan, Schedule};
use super::trained::{Reference, TrainedRotations};
use super::{Batch, Body, RotationNetwork, RotationSettings, WindowStatistics};
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::settings::TaskSetting;
use crate::models::transition::{Window, parts};
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};

/// The training of a network on the windows of clips.
pub struct RotationTask<'d> {
    network: Arc<dyn RotationNetwork<f32>>,
    forms: Forms<'d>,
    schedule: Schedule,
    shards: usize,
    reference: Reference,
    statistics: WindowStatistics,
    /// Frames before a window that are given.
    past: usize,
    streams: Streams,
    /// The windows of the epoch that was asked for last.
    epoch: Mutex<Option<(u64, Arc<Vec<Window>>)>>,
}

impl<'d> RotationTask<'d> {
    /// The training of the network that `build` makes for the body and the statistics of the
    /// training clips.
    ///
    /// # Errors
    /// Clips of several skeletons or too short for a window; a network that cannot be built.
    pub fn new<S: RotationSettings>(
        settings: &S,
        setting: &TaskSetting<'d>,
        build: impl FnOnce(
            &Body,
            &WindowStatistics,
        ) -> Result<Box<dyn RotationNetwork<f32>>, ModelError>,
    ) -> Result<Self, ModelError> {
        let clips = setting.dataset.training_clips();
        let skeletons = clips.iter().map(|it| (it.name(), it.skeleton()));
        let body = Body::of_all(skeletons)?;
        let (rule, threshold) = (settings.contact_rule(), setting.data.contact_threshold);
        let (augmentation, streams) = (settings.augmentation(), setting.streams);
        let frames: Vec<usize> = clips.iter().map(|it| it.frames()).collect();
        let forms = Forms::of(clips, augmentation, rule, threshold, streams)?;
        let config = settings.schedule();
        let past = settings.past();
        let schedule = Schedule::new(&frames, past, config, streams);
        if schedule.steps() == 0 {
            let longest = frames.iter().copied().max().unwrap_or(0);
            return Err(ModelError::Data {
                reason: format!(
                    "no training clip has the {} frames of a window (schedule.window) and of its past, \
                     the longest of {} has {longest}",
                    config.cut().needed() + past,
                    counted(frames.len(), "clip"),
                ),
            });
        }
        let statistics = WindowStatistics::of(
            (body.joints(), frames.len()),
            |clip| forms.recorded(clip),
            (schedule.windows(), config.window),
            settings.root_frame(),
        )?;
        let network = build(&body, &statistics)?;
        Ok(Self {
            reference: Reference::new(body, settings)?,
            network: network.into(),
            forms,
            schedule,
            shards: config.shards_of(config.batch_size),
            statistics,
            past,
            streams,
            epoch: Mutex::new(None),
        })
    }

    fn windows(&self, epoch: u64) -> Arc<Vec<Window>> {
        let mut kept = self.epoch.lock().unwrap_or_else(PoisonError::into_inner);
        match &*kept {
            Some((of, windows)) if *of == epoch => windows.clone(),
            _ => {
                let windows = Arc::new(self.schedule.epoch(epoch));
                *kept = Some((epoch, windows.clone()));
                windows
            }
        }
    }
}

impl Task<f32> for RotationTask<'_> {
    fn steps(&self) -> u64 {
        self.schedule.steps()
    }

    fn frame_steps(&self) -> u64 {
        self.schedule.frame_steps()
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        let epoch = self.schedule.place(step)[0];
        let plan = self.schedule.plan(step, &self.windows(epoch));
        Box::new(RotationStep {
            task: self,
            plan,
            step,
            epoch,
        })
    }

    fn place(&self, step: u64) -> [u64; 2] {
        self.schedule.place(step)
    }

    fn statistics(&self) -> Statistics {
        let statistics = self.reference.body.statistics(Statistics::default());
        self.statistics.statistics(statistics)
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedRotations::new(name, network, parameters, reference))
    }

    fn summary(&self) -> Option<String> {
        let epochs = self.schedule.place(self.schedule.steps() - 1)[0] as usize + 1;
        Some(counted(epochs, "epoch"))
    }

    fn facts(&self) -> Map<String, Value> {
        let mut facts = Map::new();
        facts.insert(
            "whole_schedule_frame_steps".into(),
            json!(self.schedule.whole_frame_steps()),
        );
        facts.insert(
            "training_windows".into(),
            json!(self.schedule.windows().len()),
        );
        facts
    }
}

/// A step of the training.
struct RotationStep<'t> {
    task: &'t RotationTask<'t>,
    plan: BatchPlan,
    step: u64,
    epoch: u64,
}

impl Step<f32> for RotationStep<'_> {
    fn shards(&self) -> usize {
        self.task.shards.min(self.plan.windows.len())
    }

    fn frames(&self) -> u64 {
        (self.plan.windows.len() * self.plan.frames) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let BatchPlan { frames, windows } = &self.plan;
        let range = parts(windows.len(), self.shards())
            .nth(shard)
            .unwrap_or(0..0);
        let (mut given, mut truths) = (Vec::new(), Vec::new());
        for index in range {
            let (streams, past) = (self.task.streams, self.task.past);
            let mut stream = streams.stream("augmentation", &[self.step, index as u64]);
            let clip = self
                .task
                .forms
                .draw(windows[index], *frames, past, &mut stream)
                .map_err(|error| AutogradError::Input(error.to_string()))?;
            let root_frame = self.task.reference.root_frame;
            let (window, truth) = clip.window(past, *frames, past, root_frame);
            given.push(window);
            truths.push(truth);
        }
        let batch = Batch {
            total_windows: windows.len(),
            ..Batch::of(&given, &truths, self.task.network.input())
        };
        self.task.network.losses(tape, &batch)
    }

    fn columns(&self) -> Vec<(&'static str, Value)> {
        vec![
            ("epoch", json!(self.epoch)),
            ("frames", json!(self.plan.frames)),
            ("batch", json!(self.plan.windows.len())),
        ]
    }

    fn describe(&self) -> String {
        let windows = counted(self.plan.windows.len(), "window");
        format!("{windows} of {}", counted(self.plan.frames, "frame"))
    }
}

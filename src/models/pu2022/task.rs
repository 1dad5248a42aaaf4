//! The training: windows of random clips with random key poses (spec, section 6).

use std::sync::Arc;

use serde_json::{Map, Value, json};

use super::batch::Batch;
use super::clips::{DrawnWindow, MusicStatistics, RecordedWindow, TrainingClip, draw, music_of};
use super::config::Pu2022Settings;
use super::generator::{Reference, TrainedPu2022};
use super::network::Pu2022;
use crate::autograd::{AutogradError, Parameters, Tape};
use crate::counted::counted;
use crate::models::rotations::Body;
use crate::models::settings::TaskSetting;
use crate::models::transition::parts;
use crate::models::{Generator, LossTerms, ModelError, Statistics, Step, Streams, Task};

/// The training of a network on dances with their music.
pub struct Pu2022Task {
    settings: Pu2022Settings,
    network: Arc<Pu2022>,
    reference: Reference,
    clips: Vec<TrainingClip>,
    starts: Vec<usize>,
    streams: Streams,
}

impl Pu2022Task {
    /// The training of the network that `build` makes for J joints.
    ///
    /// # Errors
    /// Clips of several skeletons, without music, or too short for a window; a network that cannot
    /// be built.
    pub fn new(
        settings: &Pu2022Settings,
        setting: &TaskSetting<'_>,
        build: impl FnOnce(usize) -> Result<Pu2022, ModelError>,
    ) -> Result<Self, ModelError> {
        let recordings = &setting.dataset.train;
        let skeletons = recordings.iter().map(|it| (it.name(), &it.clip.skeleton));
        let body = Body::of_all(skeletons)?;
        let set = settings.music.features;
        let heard = recordings.iter().map(|it| music_of(it, set));
        let heard = heard.collect::<Result<Vec<_>, _>>()?;
        let statistics = MusicStatistics::of(&heard);
        let mirror = settings.augmentation.mirror;
        let clips = recordings.iter().zip(&heard).map(|(recording, heard)| {
            let music = statistics.standardise(heard);
            TrainingClip::new(recording.clip.clone(), music, mirror)
        });
        let clips = clips.collect::<Result<Vec<_>, _>>()?;
        let starts: Vec<usize> = clips.iter().map(|it| it.starts(&settings.window)).collect();
        if starts.iter().all(|&starts| starts == 0) {
            let longest = recordings.iter().map(|it| it.frames()).max().unwrap_or(0);
            return Err(ModelError::Data {
                reason: format!(
                    "no training clip has the {} frames of a window (window.length), the longest \
                     of {} has {longest}",
                    settings.window.length,
                    counted(recordings.len(), "clip"),
                ),
            });
        }
        Ok(Self {
            network: build(body.joints())?.into(),
            reference: Reference::new(body, statistics, settings)?,
            settings: settings.clone(),
            clips,
            starts,
            streams: setting.streams,
        })
    }

    fn drawn(&self, step: u64, index: usize) -> DrawnWindow {
        draw(
            self.streams,
            [step, index as u64],
            &self.starts,
            &self.settings.window,
            &self.settings.schedule,
            self.settings.augmentation.mirror,
        )
    }

    fn window(&self, step: u64, index: usize) -> RecordedWindow {
        let drawn = self.drawn(step, index);
        let clip = &self.clips[drawn.clip];
        clip.window(
            drawn.start,
            &drawn.keys,
            drawn.mirrored,
            &self.settings.window,
        )
    }
}

impl Task<f32> for Pu2022Task {
    fn steps(&self) -> u64 {
        self.settings.schedule.steps
    }

    fn frame_steps(&self) -> u64 {
        let a_step = self.settings.schedule.batch_size * self.settings.window.generated();
        self.settings.schedule.steps * a_step as u64
    }

    fn step(&self, step: u64) -> Box<dyn Step<f32> + '_> {
        Box::new(Pu2022Step { task: self, step })
    }

    fn statistics(&self) -> Statistics {
        self.reference.statistics()
    }

    fn generator(&self, name: &str, parameters: Parameters<f32>) -> Box<dyn Generator> {
        let (network, reference) = (self.network.clone(), self.reference.clone());
        Box::new(TrainedPu2022::new(name, network, parameters, reference))
    }

    fn facts(&self) -> Map<String, Value> {
        let windows: usize = self.starts.iter().sum();
        Map::from_iter([("training_windows".into(), json!(windows))])
    }
}

/// A step of the training.
struct Pu2022Step<'t> {
    task: &'t Pu2022Task,
    step: u64,
}

impl Step<f32> for Pu2022Step<'_> {
    fn shards(&self) -> usize {
        self.task.settings.schedule.shards()
    }

    fn frames(&self) -> u64 {
        let settings = &self.task.settings;
        (settings.schedule.batch_size * settings.window.generated()) as u64
    }

    fn losses(&self, tape: &mut Tape<'_, f32>, shard: usize) -> Result<LossTerms, AutogradError> {
        let settings = &self.task.settings;
        let total = settings.schedule.batch_size;
        let range = parts(total, self.shards()).nth(shard).unwrap_or(0..0);
        let windows = range.map(|index| self.task.window(self.step, index));
        let (given, truths): (Vec<_>, Vec<_>) = windows.unzip();
        let batch = Batch {
            total_windows: total,
            ..Batch::of(&given, &truths, &settings.window, &settings.loss)
        };
        self.task.network.losses(tape, &batch)
    }

    fn describe(&self) -> String {
        let settings = &self.task.settings;
        let windows = counted(settings.schedule.batch_size, "window");
        format!("{windows} of {}", counted(settings.window.length, "frame"))
    }
}

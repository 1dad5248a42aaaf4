//! Which windows are trained in which batch: epochs over all training windows, one length a batch
//! (spec section 6).

use rand::RngExt as _;
use rand::seq::SliceRandom;
use serde::{Deserialize, Serialize};

use crate::data::{Window, WindowCut};
use crate::models::Shards;
use crate::models::settings::ValueError;
use crate::models::streams::Streams;

/// Longest window that a config may name, frames.
const LONGEST: usize = 10_000;
/// Most windows that a batch may have.
const LARGEST_BATCH: usize = 65_536;

/// Windows of all training clips, `epochs` times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ScheduleConfig {
    /// Frames of the windows that are cut from the clips.
    pub window: usize,
    /// Frames from the start of one to that of the next.
    pub offset: usize,
    /// Whether a window may end with its clip's last frame; the LaFAN1 benchmark leaves it out.
    pub last_frame: bool,
    /// Frames of what is trained of a window, both keyframes counted: drawn for each batch.
    pub lengths: LengthConfig,
    pub epochs: u64,
    /// Most windows in a batch.
    pub batch_size: usize,
    /// Parts that a batch is computed in.
    pub shards: Shards,
    /// Share of the steps that is trained, above 0 and at most 1.
    pub fraction: f64,
    /// In place of `fraction`: about how many frames are trained.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_steps: Option<u64>,
}

/// T is drawn uniformly from `min` to `max`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LengthConfig {
    pub min: usize,
    pub max: usize,
}

impl Default for LengthConfig {
    fn default() -> Self {
        Self { min: 5, max: 50 }
    }
}

impl Default for ScheduleConfig {
    fn default() -> Self {
        Self {
            window: 50,
            offset: 10,
            last_frame: true,
            lengths: LengthConfig::default(),
            epochs: 1000,
            batch_size: 12,
            shards: Shards::default(),
            fraction: 1.0,
            frame_steps: None,
        }
    }
}

/// Least windows in a shard that are hardly slower than more: a product over their frames.
const WORTHWHILE: usize = 6;

impl ScheduleConfig {
    /// Shards of a batch of `windows`.
    pub fn shards_of(&self, windows: usize) -> usize {
        self.shards.count(windows, WORTHWHILE)
    }

    /// # Errors
    /// The first value out of its range.
    pub fn check(&self) -> Result<(), ValueError> {
        let within = |key: &str, value: usize, least: usize, most: usize| {
            let expected = format!("a whole number from {least} to {most}");
            let key = format!("schedule.{key}");
            ValueError::unless((least..=most).contains(&value), key, value, expected)
        };
        within("window", self.window, 3, LONGEST)?;
        within("offset", self.offset, 1, LONGEST)?;
        within("lengths.max", self.lengths.max, 3, self.window)?;
        within("lengths.min", self.lengths.min, 3, self.lengths.max)?;
        within("batch_size", self.batch_size, 1, LARGEST_BATCH)?;
        self.shards.check(LARGEST_BATCH)?;
        ValueError::unless(
            self.epochs > 0,
            "schedule.epochs",
            self.epochs,
            "at least 1",
        )?;
        let share = self.fraction > 0.0 && self.fraction <= 1.0;
        let expected = "above 0 and at most 1";
        ValueError::unless(share, "schedule.fraction", self.fraction, expected)?;
        let some = self.frame_steps != Some(0);
        ValueError::unless(some, "schedule.frame_steps", 0, "at least 1")
    }

    /// How the training windows are cut from the clips.
    pub fn cut(&self) -> WindowCut {
        WindowCut {
            frames: self.window,
            every: self.offset,
            strictly: !self.last_frame,
        }
    }

    /// How much of the schedule is trained, for the caption of a table.
    pub fn budget(&self) -> String {
        let LengthConfig { min, max } = self.lengths;
        let batch = format!(
            "batches of {} windows of {min} to {max} frames",
            self.batch_size
        );
        match self.frame_steps {
            // What came of it stands beside this.
            Some(_) => batch,
            None => format!("{} of the schedule, {batch}", self.fraction),
        }
    }
}

/// The steps of a training, counted; a step's windows are drawn when it is their turn.
#[derive(Debug, Clone)]
pub struct Schedule {
    windows: Vec<Window>,
    config: ScheduleConfig,
    streams: Streams,
    steps: u64,
    whole_steps: u64,
    frame_steps: u64,
}

/// What a step trains.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BatchPlan {
    /// T.
    pub frames: usize,
    /// Where the T frames of each window start.
    pub windows: Vec<Window>,
}

impl Schedule {
    /// The windows of clips of these lengths that have `past` frames before them.
    pub fn new(
        clip_frames: &[usize],
        past: usize,
        config: &ScheduleConfig,
        streams: Streams,
    ) -> Self {
        let mut windows = config.cut().windows(clip_frames);
        windows.retain(|window| window.start >= past);
        let mut schedule = Self {
            whole_steps: windows.len().div_ceil(config.batch_size) as u64 * config.epochs,
            windows,
            config: config.clone(),
            streams,
            steps: 0,
            frame_steps: 0,
        };
        let LengthConfig { min, max } = config.lengths;
        let mean_frames = config.batch_size as f64 * (min + max) as f64 / 2.0;
        let steps = match config.frame_steps {
            Some(frames) => (frames as f64 / mean_frames).round(),
            None => (schedule.whole_steps as f64 * config.fraction).round(),
        };
        schedule.steps = (steps as u64).clamp(1, schedule.whole_steps.max(1));
        if schedule.windows.is_empty() {
            schedule.steps = 0;
        }
        let frames = |step| (schedule.length(step) * schedule.windows_in(step)) as u64;
        schedule.frame_steps = (0..schedule.steps).map(frames).sum();
        schedule
    }

    /// All training windows.
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Steps of the schedule, whatever its fraction.
    pub fn whole_steps(&self) -> u64 {
        self.whole_steps
    }

    /// Frames that the whole schedule trains, at its mean length.
    pub fn whole_frame_steps(&self) -> u64 {
        let LengthConfig { min, max } = self.config.lengths;
        self.windows.len() as u64 * self.config.epochs * (min + max) as u64 / 2
    }

    /// Frames that are trained.
    pub fn frame_steps(&self) -> u64 {
        self.frame_steps
    }

    /// Epoch, and batch in it.
    pub fn place(&self, step: u64) -> [u64; 2] {
        let batches = self.windows.len().div_ceil(self.config.batch_size).max(1) as u64;
        [step / batches, step % batches]
    }

    fn length(&self, step: u64) -> usize {
        let LengthConfig { min, max } = self.config.lengths;
        self.streams
            .stream("length", &[step])
            .random_range(min..=max)
    }

    fn windows_in(&self, step: u64) -> usize {
        let start = self.place(step)[1] as usize * self.config.batch_size;
        self.config.batch_size.min(self.windows.len() - start)
    }

    /// The windows of an epoch in the order in which they are trained.
    pub fn epoch(&self, epoch: u64) -> Vec<Window> {
        let mut windows = self.windows.clone();
        windows.shuffle(&mut self.streams.stream("shuffling", &[epoch]));
        windows
    }

    /// What a step trains of its epoch's windows.
    pub fn plan(&self, step: u64, epoch: &[Window]) -> BatchPlan {
        let start = self.place(step)[1] as usize * self.config.batch_size;
        let frames = self.length(step);
        let mut starts = self.streams.stream("first_frame", &[step]);
        let windows = epoch[start..start + self.windows_in(step)].iter();
        BatchPlan {
            frames,
            windows: windows
                .map(|&Window { clip, start }| Window {
                    clip,
                    start: start + starts.random_range(0..=self.config.window - frames),
                })
                .collect(),
        }
    }
}

//! Training clips with their music, and the windows that are drawn of them (spec, section 6).

use std::borrow::Cow;

use ndarray::{Array1, Array2, Axis, s};
use rand::RngExt as _;
use rand::seq::index;

use super::batch::GivenWindow;
use super::config::{ScheduleConfig, WindowConfig};
use super::window::WindowFrame;
use crate::data::Recording;
use crate::models::{ModelError, Streams};
use crate::motion::facing::FacingJoints;
use crate::motion::mirror::{mirrored_poses, mirrored_skeleton, partners};
use crate::motion::{Clip, Skeleton};
use crate::music::FeatureSet;

/// Columns that do not vary are not divided by their deviation.
const LEAST_DEVIATION: f64 = 1e-6;

/// Mean and standard deviation of the numbers of the music over the training clips' frames.
#[derive(Debug, Clone, PartialEq)]
pub struct MusicStatistics {
    pub mean: Array1<f64>,
    pub deviation: Array1<f64>,
}

impl MusicStatistics {
    /// Of features `[frames, numbers]` of all clips.
    pub fn of(features: &[Array2<f64>]) -> Self {
        let numbers = features.first().map_or(0, |it| it.ncols());
        let frames: usize = features.iter().map(|it| it.nrows()).sum();
        let count = frames.max(1) as f64;
        let mut mean = Array1::zeros(numbers);
        features.iter().for_each(|it| mean += &it.sum_axis(Axis(0)));
        mean /= count;
        let mut variance = Array1::<f64>::zeros(numbers);
        for row in features.iter().flat_map(|it| it.rows()) {
            variance += &(&row - &mean).mapv(|x| x * x);
        }
        let deviation = variance.mapv(|x| match (x / count).sqrt() {
            small if small < LEAST_DEVIATION => 1.0,
            deviation => deviation,
        });
        Self { mean, deviation }
    }

    /// Those of music that is standardised already.
    pub fn none(numbers: usize) -> Self {
        Self {
            mean: Array1::zeros(numbers),
            deviation: Array1::ones(numbers),
        }
    }

    /// Features with mean 0 and deviation 1.
    pub fn standardise(&self, features: &Array2<f64>) -> Array2<f64> {
        (features - &self.mean) / &self.deviation
    }
}

/// A dance with its music.
#[derive(Debug, Clone)]
pub struct TrainingClip {
    clip: Clip,
    mirrored: Option<Mirrored>,
    facing: FacingJoints,
    /// Standardised, `[frames, numbers]`.
    music: Array2<f64>,
}

/// What makes windows in the mirror.
#[derive(Debug, Clone)]
struct Mirrored {
    skeleton: Skeleton,
    /// The joint on the body's other side of each.
    partners: Vec<usize>,
}

/// A window and what was recorded of its generated frames, `[T - T', 6 J + 3]`.
pub type RecordedWindow = (GivenWindow, Array2<f64>);

/// The music of a recording's frames, `[frames, numbers]`; a last frame that the music lacks
/// repeats the one before.
///
/// # Errors
/// The recording has none.
pub fn music_of(recording: &Recording, set: FeatureSet) -> Result<Array2<f64>, ModelError> {
    let music = recording.music.as_ref().ok_or_else(|| ModelError::Data {
        reason: format!(
            "{} comes without music; set data.music = true and give a sound file of its name",
            recording.name()
        ),
    })?;
    let heard = music.features(set);
    let last = heard.nrows().saturating_sub(1);
    let shape = (recording.frames(), heard.ncols());
    Ok(Array2::from_shape_fn(shape, |(frame, number)| {
        f64::from(heard[[frame.min(last), number]])
    }))
}

impl TrainingClip {
    /// # Errors
    /// A skeleton without hips and arms that could be told by their names.
    pub fn new(clip: Clip, music: Array2<f64>, mirror: bool) -> Result<Self, ModelError> {
        let facing = FacingJoints::of(&clip.skeleton).map_err(|error| ModelError::Data {
            reason: format!("{}: {error}", clip.name),
        })?;
        Ok(Self {
            mirrored: mirror.then(|| {
                let partners = partners(&clip.skeleton);
                Mirrored {
                    skeleton: mirrored_skeleton(&partners, &clip.skeleton),
                    partners,
                }
            }),
            clip,
            facing,
            music,
        })
    }

    /// Frames at which a window may start.
    pub fn starts(&self, window: &WindowConfig) -> usize {
        (self.clip.poses.len() + 1).saturating_sub(window.length)
    }

    /// The window from frame `start` on with key poses at these frames of it.
    ///
    /// # Panics
    /// It does not lie in the clip.
    pub fn window(
        &self,
        start: usize,
        keys: &[usize],
        mirrored: bool,
        window: &WindowConfig,
    ) -> RecordedWindow {
        let poses = &self.clip.poses[start..start + window.length];
        let (skeleton, poses) = match &self.mirrored {
            Some(Mirrored { skeleton, partners }) if mirrored => {
                (skeleton, Cow::Owned(mirrored_poses(partners, poses)))
            }
            _ => (&self.clip.skeleton, Cow::Borrowed(poses)),
        };
        let frame = WindowFrame::of(skeleton, &self.facing, &poses[window.seed - 1]);
        let rows: Vec<Vec<f64>> = poses.iter().map(|pose| frame.numbers(pose)).collect();
        let table = |rows: &[Vec<f64>]| {
            let columns = rows.first().map_or(0, Vec::len);
            Array2::from_shape_fn((rows.len(), columns), |(row, column)| rows[row][column])
        };
        let given = GivenWindow {
            seed: table(&rows[..window.seed]),
            music: self
                .music
                .slice(s![start..start + window.length, ..])
                .to_owned(),
            key_poses: keys
                .iter()
                .map(|&key| (key, frame.key_pose(&poses[key])))
                .collect(),
        };
        (given, table(&rows[window.seed..]))
    }
}

/// What a step trains: clips, starts and key frames, each drawn from a stream of its own, so that
/// trainings with other losses see the same.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DrawnWindow {
    pub clip: usize,
    pub start: usize,
    /// Frames of the window, T' to T - 1.
    pub keys: Vec<usize>,
    pub mirrored: bool,
}

/// Draws the `index`-th window of a step. `starts`: at how many frames a window may start in each
/// clip; all are as likely.
pub fn draw(
    streams: Streams,
    [step, index]: [u64; 2],
    starts: &[usize],
    window: &WindowConfig,
    schedule: &ScheduleConfig,
    mirror: bool,
) -> DrawnWindow {
    let stream = |name: &str| streams.stream(name, &[step, index]);
    let total: usize = starts.iter().sum();
    let mut place = stream("window").random_range(0..total.max(1));
    let mut clip = 0;
    while clip + 1 < starts.len() && place >= starts[clip] {
        place -= starts[clip];
        clip += 1;
    }
    DrawnWindow {
        clip,
        start: place,
        keys: draw_keys(&mut stream("key_poses"), window, schedule),
        mirrored: mirror && stream("mirror").random(),
    }
}

/// From none to `schedule.key_poses` frames among the generated ones, each set of a size that keeps
/// the least distance as likely.
pub fn draw_keys(
    stream: &mut impl rand::Rng,
    window: &WindowConfig,
    schedule: &ScheduleConfig,
) -> Vec<usize> {
    let count = stream.random_range(0..=schedule.key_poses);
    let between = schedule.key_pose_distance - 1;
    let free = window.generated() - between * count.saturating_sub(1);
    let mut places = index::sample(stream, free, count).into_vec();
    places.sort_unstable();
    let places = places.into_iter().enumerate();
    places
        .map(|(number, place)| window.seed + place + number * between)
        .collect()
}

//! What the training clips hold: which controls a model has seen.

use std::convert::Infallible;

use ndarray::ArrayView2;
use serde::{Deserialize, Serialize};

use super::Standardisation;
use crate::motion::PARTS;
use crate::motion::features::{ROOT_POSITION, ROOT_VELOCITY, VELOCITY_FACTORS};
use crate::run::{RunError, Subject};

/// Share of the frames that lie below a bound.
const SHARE: f64 = 0.999;
/// How many numbers are kept beside those that are asked for.
const ROOM: usize = 1024;
/// Standard deviations from the mean that stand for the bounds where no clips are at hand.
const DEVIATIONS: f64 = 5.0;

/// Bounds of the controls over the frames of the training clips: 99.9 % of the frames lie below a
/// highest value and 99.9 % above a lowest.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataRanges {
    /// Highest speed of the root, cm/frame.
    pub root_speed: f64,
    /// Lowest and highest root, cm.
    pub root_height: [f64; 2],
    /// Highest velocity factor of trunk, left leg, right leg, right arm, left arm, cm/frame.
    pub velocity_factors: [f64; PARTS],
}

impl DataRanges {
    /// Bounds of what a model was trained on; none where it needs no training.
    ///
    /// # Errors
    /// The run's weights cannot be read.
    pub fn of_subject(subject: &Subject) -> Result<Option<Self>, RunError> {
        let config = &subject.config;
        if config.model.untrained(&config.data).is_some() {
            return Ok(None);
        }
        let manifest = subject.manifest.as_ref();
        let saved = manifest.and_then(|it| it.fact("data_ranges"));
        let Some(run) = subject.run.as_ref().filter(|_| saved.is_none()) else {
            return Ok(saved);
        };
        let weights = run.saved_weights(config)?;
        let statistics = Standardisation::saved(&weights)?;
        Ok(Some(Self::from_statistics(&statistics)))
    }

    /// Bounds over the frames of these clips, each `[frames, 154]`, not standardised. None for no
    /// frames.
    pub fn of<'a>(clips: impl IntoIterator<Item = ArrayView2<'a, f64>> + Clone) -> Option<Self> {
        let frames = clips.clone().into_iter().map(|clip| clip.nrows()).sum();
        let Ok(ranges) = Self::of_frames(frames, |visit| {
            clips.into_iter().for_each(visit);
            Ok::<(), Infallible>(())
        });
        ranges
    }

    /// The same of clips with so many frames together, which `each` goes through.
    ///
    /// # Errors
    /// Those of `each`.
    pub fn of_frames<E>(
        frames: usize,
        each: impl FnOnce(&mut dyn FnMut(ArrayView2<'_, f64>)) -> Result<(), E>,
    ) -> Result<Option<Self>, E> {
        let Some(last) = frames.checked_sub(1) else {
            return Ok(None);
        };
        let at = |share: f64| ((share * last as f64).round() as usize).min(last);
        let above = Extreme::new(frames - at(SHARE));
        let below = Extreme::new(at(1.0 - SHARE) + 1);
        let (mut speeds, mut highest, mut lowest) = (above.clone(), above.clone(), below);
        let mut factors: [Extreme; PARTS] = std::array::from_fn(|_| above.clone());
        each(&mut |clip| {
            for row in clip.rows() {
                let squares = ROOT_VELOCITY.map(|number| row[number] * row[number]);
                speeds.take(squares.sum::<f64>().sqrt());
                highest.take(row[ROOT_POSITION.start + 1]);
                lowest.take(-row[ROOT_POSITION.start + 1]);
                for (factor, number) in factors.iter_mut().zip(VELOCITY_FACTORS) {
                    factor.take(row[number]);
                }
            }
        })?;
        Ok(Some(Self {
            root_speed: speeds.least(),
            root_height: [-lowest.least(), highest.least()],
            velocity_factors: factors.map(Extreme::least),
        }))
    }

    /// Wider bounds from means and standard deviations alone: five deviations from the mean.
    pub fn from_statistics(statistics: &Standardisation) -> Self {
        let bound = |number: usize, sign: f64| {
            statistics.mean[number] + sign * DEVIATIONS * statistics.std[number]
        };
        let height = ROOT_POSITION.start + 1;
        let fastest = |number: usize| bound(number, 1.0).abs().max(bound(number, -1.0).abs());
        Self {
            root_speed: ROOT_VELOCITY
                .map(|number| fastest(number).powi(2))
                .sum::<f64>()
                .sqrt(),
            root_height: [bound(height, -1.0), bound(height, 1.0)],
            velocity_factors: std::array::from_fn(|part| bound(VELOCITY_FACTORS.start + part, 1.0)),
        }
    }
}

/// The largest of many numbers.
#[derive(Clone)]
struct Extreme {
    /// How many are asked for.
    count: usize,
    /// These and, until they are sorted out, others.
    values: Vec<f64>,
}

impl Extreme {
    fn new(count: usize) -> Self {
        Self {
            count,
            values: Vec::new(),
        }
    }

    fn take(&mut self, value: f64) {
        self.values.push(value);
        if self.values.len() >= 2 * self.count + ROOM {
            self.keep();
        }
    }

    fn keep(&mut self) {
        if self.values.len() > self.count {
            let descending = |a: &f64, b: &f64| b.total_cmp(a);
            self.values
                .select_nth_unstable_by(self.count - 1, descending);
            self.values.truncate(self.count);
        }
    }

    /// The least of the largest that were asked for.
    fn least(mut self) -> f64 {
        self.keep();
        self.values.into_iter().fold(f64::INFINITY, f64::min)
    }
}

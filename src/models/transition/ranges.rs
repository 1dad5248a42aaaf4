//! What the training clips hold: which controls a model has seen.

use ndarray::ArrayView2;
use serde::{Deserialize, Serialize};

use super::Standardisation;
use crate::motion::PARTS;
use crate::motion::features::{ROOT_POSITION, ROOT_VELOCITY, VELOCITY_FACTORS};
use crate::run::{RunError, Subject};

/// Share of the frames that lie below a bound.
const SHARE: f64 = 0.999;
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
        let column = |number: usize| -> Vec<f64> {
            let clips = clips.clone().into_iter();
            clips
                .flat_map(|clip| clip.column(number).to_vec())
                .collect()
        };
        let speeds: Vec<f64> = clips
            .clone()
            .into_iter()
            .flat_map(|clip| {
                let frames = clip.rows().into_iter();
                let speed = |row: ndarray::ArrayView1<f64>| {
                    ROOT_VELOCITY
                        .map(|number| row[number] * row[number])
                        .sum::<f64>()
                        .sqrt()
                };
                frames.map(speed).collect::<Vec<_>>()
            })
            .collect();
        let heights = column(ROOT_POSITION.start + 1);
        let mut factors = [0.0; PARTS];
        for (factor, number) in factors.iter_mut().zip(VELOCITY_FACTORS) {
            *factor = quantile(column(number), SHARE)?;
        }
        Some(Self {
            root_speed: quantile(speeds, SHARE)?,
            root_height: [
                quantile(heights.clone(), 1.0 - SHARE)?,
                quantile(heights, SHARE)?,
            ],
            velocity_factors: factors,
        })
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

/// The value below which this share of the values lies.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    let last = values.len().checked_sub(1)?;
    let at = (share * last as f64).round() as usize;
    Some(
        *values
            .select_nth_unstable_by(at.min(last), f64::total_cmp)
            .1,
    )
}

//! Standardisation: mean and standard deviation of each feature over the training clips.

use std::convert::Infallible;

use ndarray::{Array1, Array2, ArrayView2};
use serde::{Deserialize, Serialize};

use super::window::wrap;
use crate::models::Statistics;
use crate::models::weights::{SavedWeights, WeightsError};
use crate::motion::features::{BODY_POSITIONS, BODY_VELOCITIES, FACING, FEATURES};

/// A standard deviation below this, in the feature's unit, counts as 1: a number that never changes
/// is only centred.
pub(crate) const SMALLEST_STD: f64 = 1e-4;
/// Names of its arrays in a weights file.
const MEAN: &str = "feature_mean";
const STD: &str = "feature_std";
const POSITION_SCALE: &str = "position_scale";
const VELOCITY_SCALE: &str = "velocity_scale";

/// Mean and standard deviation of the 154 numbers of a frame, and the scales of the losses that are
/// not standardised.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Standardisation {
    /// `[154]`, each in its feature's unit.
    pub mean: Vec<f64>,
    /// `[154]`, each in its feature's unit.
    pub std: Vec<f64>,
    /// Root mean square of the standard deviations of p^b's 69 numbers, cm.
    pub position_scale: f64,
    /// Root mean square of the standard deviations of v^b's 69 numbers, cm/frame.
    pub velocity_scale: f64,
}

impl Standardisation {
    /// Statistics over all frames of the training clips, each `[frames, 154]`, every frame counting
    /// the same.
    ///
    /// The facing angle is measured in [-pi, pi), as at the start of a window: unwrapped along a
    /// clip it counts the turns that the dancer has made, which no window shows. No frames give
    /// mean 0 and deviation 1.
    pub fn fit<'a>(clips: impl IntoIterator<Item = ArrayView2<'a, f64>> + Clone) -> Self {
        let Ok(fitted) = Self::fit_visited(|visit| {
            clips.clone().into_iter().for_each(visit);
            Ok::<(), Infallible>(())
        });
        fitted
    }

    /// The same of clips that `each` goes through, one after the other, as often as it is called.
    ///
    /// # Errors
    /// Those of `each`.
    pub fn fit_visited<E>(
        each: impl Fn(&mut dyn FnMut(ArrayView2<'_, f64>)) -> Result<(), E>,
    ) -> Result<Self, E> {
        let mean_of = |deviation: &dyn Fn(usize, f64) -> f64| -> Result<Vec<f64>, E> {
            let (mut sums, mut frames) = (vec![0.0; FEATURES], 0);
            each(&mut |clip| {
                frames += clip.nrows();
                for frame in clip.rows() {
                    for (column, (sum, &value)) in sums.iter_mut().zip(frame).enumerate() {
                        let value = if column == FACING.start {
                            wrap(value)
                        } else {
                            value
                        };
                        *sum += deviation(column, value);
                    }
                }
            })?;
            let count = frames.max(1) as f64;
            sums.iter_mut().for_each(|sum| *sum /= count);
            Ok(sums)
        };
        let mean = mean_of(&|_, value| value)?;
        let variance = mean_of(&|column, value| (value - mean[column]).powi(2))?;
        let std: Vec<f64> = variance
            .into_iter()
            .map(|variance| {
                if variance.sqrt() < SMALLEST_STD {
                    1.0
                } else {
                    variance.sqrt()
                }
            })
            .collect();
        let root_mean_square = |std: &[f64]| {
            (std.iter().map(|value| value * value).sum::<f64>() / std.len() as f64).sqrt()
        };
        let position_scale = root_mean_square(&std[BODY_POSITIONS]);
        let velocity_scale = root_mean_square(&std[BODY_VELOCITIES]);
        Ok(Self {
            mean,
            std,
            position_scale,
            velocity_scale,
        })
    }

    /// `(x - mean) / std` of the leading columns that `features` has, `[frames, up to 154]`.
    pub fn standardise(&self, features: ArrayView2<f64>) -> Array2<f64> {
        Array2::from_shape_fn(features.raw_dim(), |(row, column)| {
            (features[[row, column]] - self.mean[column]) / self.std[column]
        })
    }

    /// The inverse of [`Standardisation::standardise`].
    pub fn restore(&self, standardised: ArrayView2<f64>) -> Array2<f64> {
        Array2::from_shape_fn(standardised.raw_dim(), |(row, column)| {
            standardised[[row, column]] * self.std[column] + self.mean[column]
        })
    }

    /// As what is saved beside the weights: `feature_mean [154]`, `feature_std [154]`,
    /// `position_scale [1]`, `velocity_scale [1]`.
    pub fn statistics(&self) -> Statistics {
        let array = |values: &[f64]| Array1::from(values.to_vec()).into_dyn();
        Statistics::default()
            .with(MEAN, array(&self.mean))
            .with(STD, array(&self.std))
            .with(POSITION_SCALE, array(&[self.position_scale]))
            .with(VELOCITY_SCALE, array(&[self.velocity_scale]))
    }

    /// Those of a weights file.
    ///
    /// # Errors
    /// It lacks one, or a number is not finite or, of a deviation or scale, not above 0.
    pub fn saved(weights: &SavedWeights) -> Result<Self, WeightsError> {
        let numbers = |name: &'static str, count: usize| -> Result<Vec<f64>, WeightsError> {
            let numbers: Vec<f64> = weights.statistic(name, &[count])?.into_iter().collect();
            let problem = match numbers.iter().all(|x| x.is_finite()) {
                false => "has a NaN or an infinity",
                true if name == MEAN || numbers.iter().all(|&x| x > 0.0) => return Ok(numbers),
                true => "has a number that is not above 0",
            };
            Err(WeightsError::Value {
                path: weights.path.clone(),
                name,
                problem,
            })
        };
        Ok(Self {
            mean: numbers(MEAN, FEATURES)?,
            std: numbers(STD, FEATURES)?,
            position_scale: numbers(POSITION_SCALE, 1)?[0],
            velocity_scale: numbers(VELOCITY_SCALE, 1)?[0],
        })
    }
}

//! Adam (Kingma and Ba, 2015), as PyTorch computes it.
//!
//! With g the gradient and t the number of the step, from 1:
//!
//! ```text
//! m <- m + (1 - beta1) (g - m)
//! v <- beta2 v + (1 - beta2) g^2
//! w <- w - learning_rate / (1 - beta1^t) * m / (sqrt(v) / sqrt(1 - beta2^t) + epsilon)
//! ```

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::learning_rate::RateSchedule;
use crate::autograd::kernels::vectorised;
use crate::autograd::{Gradients, Parameters, Real};

/// Numbers that one task works on; fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 1 << 14;

/// Adam's settings; the defaults are the paper's and, where it is silent, PyTorch's.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AdamConfig {
    /// The rate, or where it has a schedule the highest.
    pub learning_rate: f64,
    /// Rates of their own of groups of weights that the model names, such as `{ encoder = 1e-4 }`;
    /// others have `learning_rate`. They follow the same schedule.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub rates: BTreeMap<String, f64>,
    /// Decay of the mean of gradients.
    pub beta1: f64,
    /// Decay of the mean of squared gradients.
    pub beta2: f64,
    /// Added to the denominator, after the square root.
    pub epsilon: f64,
    /// Longest gradient over all parameters together; a longer one is scaled down to it. Left out:
    /// no limit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_norm: Option<f64>,
    /// How the rate changes over the training. Left out: not at all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_schedule: Option<RateSchedule>,
}

impl AdamConfig {
    /// The defaults at this learning rate.
    pub fn with_rate(learning_rate: f64) -> Self {
        Self {
            learning_rate,
            ..Self::default()
        }
    }

    /// The learning rate at a step, counted from 0, of a training of `steps` steps.
    pub fn learning_rate_at(&self, step: u64, steps: u64) -> f64 {
        match self.rate_schedule {
            None => self.learning_rate,
            Some(schedule) => self.learning_rate * schedule.share(step, steps),
        }
    }

    /// Checks every setting by itself.
    ///
    /// # Errors
    /// The first out of its range.
    pub fn check(&self) -> Result<(), SettingError> {
        let unless = |valid: bool, key: &str, value: f64, expected| match valid {
            true => Ok(()),
            false => Err(SettingError {
                key: key.into(),
                value,
                expected,
            }),
        };
        let positive = |key: &str, x: f64| {
            let valid = x > 0.0 && x.is_finite();
            unless(valid, key, x, "a number above 0")
        };
        let beta = |key: &str, x: f64| {
            let valid = (0.0..1.0).contains(&x);
            unless(valid, key, x, "at least 0 and below 1")
        };
        positive("learning_rate", self.learning_rate)?;
        for (group, &rate) in &self.rates {
            positive(&format!("rates.{group}"), rate)?;
        }
        beta("beta1", self.beta1)?;
        beta("beta2", self.beta2)?;
        positive("epsilon", self.epsilon)?;
        if let Some(norm) = self.clip_norm {
            positive("clip_norm", norm)?;
        }
        let schedule = self.rate_schedule.unwrap_or_default();
        let [first, second] = schedule.drops;
        for (key, share) in [
            ("final_share", schedule.final_share),
            ("drops", first),
            ("drops", second),
        ] {
            let valid = (0.0..=1.0).contains(&share);
            let key = format!("rate_schedule.{key}");
            unless(valid, &key, share, "at least 0 and at most 1")?;
        }
        Ok(())
    }

    /// The rate of a group of weights over that of the others, the same at every step.
    fn share_of(&self, group: Option<&str>) -> f64 {
        group
            .and_then(|group| self.rates.get(group))
            .map_or(1.0, |rate| rate / self.learning_rate)
    }
}

impl Default for AdamConfig {
    fn default() -> Self {
        Self {
            learning_rate: 1e-4,
            rates: BTreeMap::new(),
            beta1: 0.9,
            beta2: 0.999,
            epsilon: 1e-8,
            clip_norm: None,
            rate_schedule: None,
        }
    }
}

/// A setting, or the learning rate of a step, that is out of its range.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{key} = {value}: expected {expected}")]
pub struct SettingError {
    pub key: String,
    pub value: f64,
    pub expected: &'static str,
}

/// Why there is no optimiser, or no step of it; then no weight was changed.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum AdamError {
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error(
        "Adam: the weights or gradients are those of other parameters than the optimiser was made \
         for: make it and Gradients::zeros once all parameters are added"
    )]
    OtherParameters,
    #[error(
        "the gradient of {parameter} {shape:?} holds a NaN or an infinity: Tape::with_trace names \
         the operation that made it"
    )]
    NonFinite {
        parameter: String,
        shape: Vec<usize>,
    },
}

/// The optimiser's state: two moments for every weight, and the number of steps.
///
/// ```
/// use keydance::autograd::{Gradients, Parameters};
/// use keydance::optim::{Adam, AdamConfig};
///
/// let mut parameters = Parameters::<f64>::new();
/// parameters.add("weight", ndarray::arr1(&[1.0]).into_dyn());
/// let mut adam = Adam::new(AdamConfig::with_rate(0.1), &parameters)?;
/// let mut gradients = Gradients::zeros(&parameters);
/// gradients.iter_mut().for_each(|of_weight| of_weight.fill(2.0));
/// adam.step(&mut parameters, &mut gradients)?;
/// let (_, weight) = parameters.iter().next().unwrap();
/// assert!((weight[[0]] - 0.9).abs() < 1e-8);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Adam<T> {
    config: AdamConfig,
    steps: u64,
    /// Steps of the whole training.
    planned: u64,
    /// The rate of each parameter over the learning rate.
    shares: Vec<f64>,
    /// m and v of each parameter, in its layout.
    first: Vec<Vec<T>>,
    second: Vec<Vec<T>>,
}

/// What is the same for all weights of a parameter in a step.
#[derive(Clone, Copy)]
struct Factors<T> {
    gradient: T,
    first: T,
    second: T,
    square: T,
    rate: T,
    root: T,
    epsilon: T,
}

impl<T: Real> Adam<T> {
    /// Moments of zero for every parameter, all at the config's rate.
    ///
    /// # Errors
    /// A setting out of its range.
    pub fn new(config: AdamConfig, parameters: &Parameters<T>) -> Result<Self, SettingError> {
        config.check()?;
        let zeros = || -> Vec<Vec<T>> {
            parameters
                .iter()
                .map(|(_, value)| vec![T::zero(); value.len()])
                .collect()
        };
        Ok(Self {
            config,
            steps: 0,
            planned: u64::MAX,
            shares: vec![1.0; parameters.len()],
            first: zeros(),
            second: zeros(),
        })
    }

    /// The same with groups of weights at rates of their own: `rate_group` says of the name of each
    /// of the `parameters` which of [`AdamConfig::rates`] it has, if any.
    #[must_use]
    pub fn with_rate_groups<'g>(
        mut self,
        parameters: &Parameters<T>,
        rate_group: impl Fn(&str) -> Option<&'g str>,
    ) -> Self {
        let shares = self.shares.iter_mut().zip(parameters.iter());
        for (share, (name, _)) in shares {
            *share = self.config.share_of(rate_group(name));
        }
        self
    }

    /// The same for a training of this many steps, over which [`AdamConfig::rate_schedule`] changes
    /// the rate; without it the rate stays where the warm-up leaves it.
    #[must_use]
    pub fn for_steps(mut self, steps: u64) -> Self {
        self.planned = steps;
        self
    }

    /// The learning rate of the next step.
    pub fn learning_rate(&self) -> f64 {
        self.config.learning_rate_at(self.steps, self.planned)
    }

    /// Steps done.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// m and v of each parameter, in the parameters' order.
    pub fn moments(&self) -> [&[Vec<T>]; 2] {
        [&self.first, &self.second]
    }

    /// Takes up a saved state. Gives it back where its sizes are not those of the parameters.
    pub fn restore(
        &mut self,
        steps: u64,
        moments: [Vec<Vec<T>>; 2],
    ) -> Result<(), [Vec<Vec<T>>; 2]> {
        let sizes = |moments: &[Vec<T>]| moments.iter().map(Vec::len).collect::<Vec<_>>();
        let expected = sizes(&self.first);
        if moments.iter().any(|moments| sizes(moments) != expected) {
            return Err(moments);
        }
        [self.first, self.second] = moments;
        self.steps = steps;
        Ok(())
    }

    /// One step, see [`Adam::step_shards`].
    ///
    /// # Errors
    /// As [`Adam::step_shards`].
    pub fn step(
        &mut self,
        parameters: &mut Parameters<T>,
        gradients: &mut Gradients<T>,
    ) -> Result<f64, AdamError> {
        self.step_shards(parameters, std::slice::from_mut(gradients))
    }

    /// One step with the sum of the shards' gradients, added in their order; leaves every gradient
    /// at zero. Returns the norm of the sum over all parameters. Runs on rayon's current pool; the
    /// result does not depend on its threads.
    ///
    /// # Errors
    /// A gradient that is not finite, a rate that is beyond the weights' numbers, weights or
    /// gradients of other parameters; then no weight, no moment is changed, and the gradients are
    /// undefined.
    pub fn step_shards(
        &mut self,
        parameters: &mut Parameters<T>,
        shards: &mut [Gradients<T>],
    ) -> Result<f64, AdamError> {
        let learning_rate = self.learning_rate();
        let lengths = parameters.iter().map(|(_, value)| value.len());
        if !lengths.eq(self.first.iter().map(Vec::len))
            || !shards.iter().all(|shard| shard.fit(parameters))
        {
            return Err(AdamError::OtherParameters);
        }
        let Some((sum, rest)) = shards.split_first_mut() else {
            return Ok(0.0);
        };
        let norm = total_norm(parameters, add(sum, rest))?;
        let steps = self.steps.saturating_add(1);
        let factors: Vec<_> = self
            .shares
            .iter()
            .map(|share| self.factors(steps, norm, learning_rate * share))
            .collect();
        let none = factors.iter().any(|factors| factors.rate.is_nan());
        if none || learning_rate < 0.0 || !learning_rate.is_finite() {
            return Err(AdamError::Setting(SettingError {
                key: "the learning rate of a step".into(),
                value: learning_rate,
                expected: "a number, 0 or more",
            }));
        }
        self.steps = steps;
        let chunks: Vec<_> = parameters
            .values_mut()
            .zip(sum.iter_mut())
            .zip(self.first.iter_mut().zip(&mut self.second))
            .zip(factors)
            .flat_map(|((((_, w), g), (m, v)), factors)| {
                let w = w.into_slice().expect("a parameter is in standard layout");
                w.chunks_mut(CHUNK)
                    .zip(g.chunks_mut(CHUNK))
                    .zip(m.chunks_mut(CHUNK).zip(v.chunks_mut(CHUNK)))
                    .map(move |chunk| (factors, chunk))
            })
            .collect();
        chunks
            .into_par_iter()
            .for_each(|(factors, ((w, g), (m, v)))| update(factors, w, g, m, v));
        Ok(norm)
    }

    fn factors(&self, steps: u64, norm: f64, learning_rate: f64) -> Factors<T> {
        let AdamConfig {
            beta1,
            beta2,
            epsilon,
            clip_norm,
            ..
        } = self.config;
        let correction = |beta: f64| 1.0 - beta.powf(steps as f64);
        let clip = clip_norm.map_or(1.0, |limit| (limit / (norm + 1e-6)).min(1.0));
        Factors {
            gradient: T::from_f64(clip),
            first: T::from_f64(1.0 - beta1),
            second: T::from_f64(beta2),
            square: T::from_f64(1.0 - beta2),
            rate: T::from_f64(learning_rate / correction(beta1)),
            root: T::from_f64(1.0 / correction(beta2).sqrt()),
            epsilon: T::from_f64(epsilon),
        }
    }
}

/// Adds the gradients of `rest` to `sum` and leaves those at zero. Returns the sum of squares of
/// every parameter.
fn add<T: Real>(sum: &mut Gradients<T>, rest: &mut [Gradients<T>]) -> Vec<f64> {
    let mut rest: Vec<_> = rest.iter_mut().map(Gradients::iter_mut).collect();
    let mut chunks = Vec::new();
    for (parameter, sum) in sum.iter_mut().enumerate() {
        let mut others: Vec<_> = rest
            .iter_mut()
            .filter_map(|shard| shard.next().map(|values| values.chunks_mut(CHUNK)))
            .collect();
        for sum in sum.chunks_mut(CHUNK) {
            let others: Vec<_> = others.iter_mut().filter_map(Iterator::next).collect();
            chunks.push((parameter, sum, others));
        }
    }
    let squares: Vec<(usize, f64)> = chunks
        .into_par_iter()
        .map(|(parameter, sum, others)| {
            for other in others {
                vectorised(
                    #[inline(always)]
                    || {
                        for (sum, other) in sum.iter_mut().zip(other) {
                            *sum += *other;
                            *other = T::zero();
                        }
                    },
                );
            }
            (parameter, sum_of_squares(sum))
        })
        .collect();
    let count = squares.last().map_or(0, |(parameter, _)| parameter + 1);
    let mut totals = vec![0.0; count];
    for (parameter, square) in squares {
        totals[parameter] += square;
    }
    totals
}

/// In f64, where no finite f32 has an infinite square: the sum is finite exactly if all f32 are.
fn sum_of_squares<T: Real>(values: &[T]) -> f64 {
    vectorised(
        #[inline(always)]
        || {
            let mut lanes = [0.0; 8];
            let (whole, rest) = values.as_chunks::<8>();
            for values in whole {
                for (lane, x) in lanes.iter_mut().zip(values) {
                    let x = Real::to_f64(*x);
                    *lane += x * x;
                }
            }
            for (lane, x) in lanes.iter_mut().zip(rest) {
                let x = Real::to_f64(*x);
                *lane += x * x;
            }
            lanes.iter().sum()
        },
    )
}

fn total_norm<T: Real>(parameters: &Parameters<T>, squares: Vec<f64>) -> Result<f64, AdamError> {
    let bad = parameters
        .iter()
        .zip(&squares)
        .find(|(_, square)| !square.is_finite());
    match bad {
        Some(((name, value), _)) => Err(AdamError::NonFinite {
            parameter: name.into(),
            shape: value.shape().to_vec(),
        }),
        None => Ok(squares.iter().sum::<f64>().sqrt()),
    }
}

fn update<T: Real>(k: Factors<T>, w: &mut [T], g: &mut [T], m: &mut [T], v: &mut [T]) {
    vectorised(
        #[inline(always)]
        || {
            for ((w, g), (m, v)) in w.iter_mut().zip(g).zip(m.iter_mut().zip(v)) {
                let gradient = *g * k.gradient;
                *g = T::zero();
                *m += (gradient - *m) * k.first;
                *v = *v * k.second + gradient * gradient * k.square;
                *w -= k.rate * *m / (v.sqrt() * k.root + k.epsilon);
            }
        },
    );
}

//! The learning rate over a training.

use serde::{Deserialize, Serialize};

/// How the learning rate falls once it is warmed up; p is the share of the remaining steps that is
/// done, from 0 to below 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RateShape {
    /// It does not.
    Constant,
    /// By `1 - p`.
    Linear,
    /// By `(1 + cos(pi p)) / 2` (Loshchilov and Hutter, 2017, without restarts).
    Cosine,
}

/// A learning rate that changes: up from zero over `warmup_steps`, then from the whole rate towards
/// `final_share` of it.
///
/// It depends on the step and on the number of steps of the trained share of the schedule only, so
/// a resumed training has the same.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RateSchedule {
    pub shape: RateShape,
    /// Steps of warming up: the k-th of w has k/w of the rate.
    pub warmup_steps: u64,
    /// What is left of the learning rate at the end, as a share of it, from 0 to 1.
    pub final_share: f64,
}

impl Default for RateSchedule {
    fn default() -> Self {
        Self {
            shape: RateShape::Cosine,
            warmup_steps: 0,
            final_share: 0.0,
        }
    }
}

impl RateSchedule {
    /// The share of the learning rate at a step, counted from 0, of a training of `steps` steps.
    ///
    /// The last step has a little more than `final_share`: a step at a rate of 0 would be none.
    pub fn share(&self, step: u64, steps: u64) -> f64 {
        if step < self.warmup_steps {
            return (step + 1) as f64 / self.warmup_steps as f64;
        }
        let falling = steps.saturating_sub(self.warmup_steps).max(1);
        let done = ((step - self.warmup_steps) as f64 / falling as f64).min(1.0);
        let left = match self.shape {
            RateShape::Constant => return 1.0,
            RateShape::Linear => 1.0 - done,
            RateShape::Cosine => (1.0 + (std::f64::consts::PI * done).cos()) / 2.0,
        };
        self.final_share + (1.0 - self.final_share) * left
    }
}

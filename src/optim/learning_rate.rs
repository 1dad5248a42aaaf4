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
    /// To a tenth of the rate where p reaches the first of `drops`, to a hundredth at the second;
    /// `final_share` has no say.
    Drops,
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
    /// Where the rate of the shape `drops` falls, as shares of the remaining steps.
    #[serde(skip_serializing_if = "are_usual")]
    pub drops: [f64; 2],
    /// What is left of the learning rate at the end, as a share of it, from 0 to 1.
    pub final_share: f64,
}

/// After 100,000 and 250,000 of 300,000 steps.
const USUAL_DROPS: [f64; 2] = [1.0 / 3.0, 5.0 / 6.0];

/// Keys that keep their defaults are left out of a run's config, so that older versions read it.
fn are_usual(drops: &[f64; 2]) -> bool {
    *drops == USUAL_DROPS
}

impl Default for RateSchedule {
    fn default() -> Self {
        Self {
            shape: RateShape::Cosine,
            warmup_steps: 0,
            drops: USUAL_DROPS,
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
            RateShape::Drops => {
                let dropped = self.drops.iter().filter(|at| done >= **at).count();
                return 0.1_f64.powi(dropped as i32);
            }
            RateShape::Linear => 1.0 - done,
            RateShape::Cosine => (1.0 + (std::f64::consts::PI * done).cos()) / 2.0,
        };
        self.final_share + (1.0 - self.final_share) * left
    }
}

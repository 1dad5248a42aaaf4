//! The budget of a training in words, for the caption of its scores.

use super::thousands;
use crate::counted::counted;
use crate::experiment::ExperimentConfig;
use crate::optim::{AdamConfig, RateShape};
use crate::run::{Manifest, RunState};

/// The note of a model that has no weights.
pub const NO_TRAINING: &str = "needs no training";

/// The budget of a training, for a caption; all but the seed.
pub fn schedule_note(config: &ExperimentConfig, manifest: &Manifest) -> String {
    let done = manifest.frame_steps_done;
    let mut note = format!("{} frame-steps", thousands(done));
    if let Some(whole) = manifest.fact::<u64>("whole_schedule_frame_steps") {
        note += &format!(
            " ({:.3} % of the whole schedule's {})",
            100.0 * done as f64 / whole as f64,
            thousands(whole)
        );
    }
    let budget = config.model.budget_note();
    for part in [budget, learning_rate(&config.optimiser)] {
        if !part.is_empty() {
            note += &format!(", {part}");
        }
    }
    if manifest.state != RunState::Finished {
        note += &format!(
            "; not finished: {} of {} steps",
            manifest.steps_done, manifest.steps
        );
    }
    note
}

fn learning_rate(optimiser: &AdamConfig) -> String {
    let rate = optimiser.learning_rate;
    let mut text = format!("learning rate {rate}");
    for (group, rate) in &optimiser.rates {
        text += &format!(" ({rate} for {group})");
    }
    let Some(schedule) = optimiser.rate_schedule else {
        return text;
    };
    if schedule.warmup_steps > 0 {
        text += &format!(
            " after {} of warm-up",
            counted(schedule.warmup_steps, "step")
        );
    }
    let shape = match schedule.shape {
        RateShape::Constant => return text,
        RateShape::Drops => {
            let drops = schedule.drops.map(|at| format!("{:.0} %", 100.0 * at));
            return text + &format!(", a tenth after {} and again after {}", drops[0], drops[1]);
        }
        RateShape::Linear => "linearly",
        RateShape::Cosine => "as a cosine",
    };
    text + &format!(", falling {shape} to {}", rate * schedule.final_share)
}

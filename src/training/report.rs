//! What one step did.

use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::evaluation::Scores;
use crate::models::Watched;

/// What one step did: a line of `log.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StepReport {
    /// Steps done, this one included.
    pub step: u64,
    /// The task's own columns.
    #[serde(flatten, serialize_with = "by_name")]
    pub columns: Vec<(&'static str, Value)>,
    /// The loss that is minimised.
    pub total: f64,
    /// Its terms by name, not weighted.
    #[serde(serialize_with = "by_name")]
    pub losses: Vec<(&'static str, f64)>,
    /// What to keep an eye on: the least of each.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "least")]
    pub watched: Vec<Watched>,
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before any clipping.
    pub gradient_norm: f64,
    /// Frames trained so far, this step's included.
    pub frame_steps: u64,
    /// Wall-clock time of the step.
    pub seconds: f64,
    pub frame_steps_per_second: f64,
    /// Scores on validation clips after the step, where it was scored.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation: Option<Scores>,
}

impl StepReport {
    /// What is out of bounds of what is watched.
    pub fn alarms(&self) -> impl Iterator<Item = Watched> {
        let watched = self.watched.iter().copied();
        watched.filter(|watched| watched.least < watched.bound)
    }

    /// One of the task's own columns.
    pub fn column(&self, name: &str) -> Option<&Value> {
        let found = self.columns.iter().find(|(column, _)| *column == name);
        found.map(|(_, value)| value)
    }
}

fn least<S: Serializer>(watched: &[Watched], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(watched.iter().map(|watched| (watched.name, watched.least)))
}

fn by_name<V: Serialize, S: Serializer>(
    entries: &[(&'static str, V)],
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.collect_map(entries.iter().map(|(name, value)| (name, value)))
}

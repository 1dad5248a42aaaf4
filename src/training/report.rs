//! What one step did.

use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use serde_json::Value;

use crate::evaluation::Scores;

/// What one step did: a line of `log.jsonl`.
#[derive(Debug, Clone, PartialEq)]
pub struct StepReport {
    /// Steps done, this one included.
    pub step: u64,
    /// The task's own columns.
    pub columns: Vec<(&'static str, Value)>,
    /// The loss that is minimised.
    pub total: f64,
    /// Its terms by name, not weighted.
    pub losses: Vec<(&'static str, f64)>,
    pub learning_rate: f64,
    /// Norm of the gradient over all parameters, before any clipping.
    pub gradient_norm: f64,
    /// Frames trained so far, this step's included.
    pub frame_steps: u64,
    /// Wall-clock time of the step.
    pub seconds: f64,
    pub frame_steps_per_second: f64,
    /// Scores on validation clips after the step, where it was scored.
    pub validation: Option<Scores>,
}

impl StepReport {
    /// One of the task's own columns.
    pub fn column(&self, name: &str) -> Option<&Value> {
        let found = self.columns.iter().find(|(column, _)| *column == name);
        found.map(|(_, value)| value)
    }
}

/// Loss terms as a map in their order.
struct ByName<'a>(&'a [(&'static str, f64)]);

impl Serialize for ByName<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().copied())
    }
}

impl Serialize for StepReport {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("step", &self.step)?;
        for (name, value) in &self.columns {
            map.serialize_entry(name, value)?;
        }
        map.serialize_entry("total", &self.total)?;
        map.serialize_entry("losses", &ByName(&self.losses))?;
        map.serialize_entry("learning_rate", &self.learning_rate)?;
        map.serialize_entry("gradient_norm", &self.gradient_norm)?;
        map.serialize_entry("frame_steps", &self.frame_steps)?;
        map.serialize_entry("seconds", &self.seconds)?;
        map.serialize_entry("frame_steps_per_second", &self.frame_steps_per_second)?;
        if let Some(validation) = &self.validation {
            map.serialize_entry("validation", validation)?;
        }
        map.end()
    }
}

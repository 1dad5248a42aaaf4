//! Scores on validation clips while a training goes on: how much more the budget would buy.

use super::error::TrainingError;
use crate::counted::counted;
use crate::data::{DataPart, Dataset, Recording};
use crate::evaluation::{Better, EvaluationError, EvaluationOptions, Protocol, Scores};
use crate::experiment::ExperimentConfig;
use crate::models::Generator;

/// What a training scores itself by.
pub struct Validation<'d> {
    dataset: &'d Dataset,
    protocol: Box<dyn Protocol>,
    every_steps: u64,
}

impl<'d> Validation<'d> {
    /// None where the config asks for no scores. Refuses what could not be scored, before anything
    /// is trained.
    ///
    /// # Errors
    /// No validation clips, or none with more frames than a length.
    pub fn new(
        config: &ExperimentConfig,
        dataset: &'d Dataset,
    ) -> Result<Option<Self>, TrainingError> {
        let Some(asked) = &config.validation else {
            return Ok(None);
        };
        let options = EvaluationOptions {
            lengths: asked.lengths.clone().unwrap_or_default(),
            most_windows: Some(asked.windows),
        };
        let mut protocols = config.protocols_with(&options).into_iter();
        let protocol = protocols.next().ok_or_else(|| {
            let kind = config.model.kind();
            TrainingError::Refused(format!(
                "model.kind = {kind} has no protocol to score validation clips by; leave \
                 [validation] out"
            ))
        })?;
        let frames = DataPart::Validation.of(dataset)?.iter();
        let longest = frames.map(Recording::frames).max().unwrap_or(0);
        let mut lengths = protocol.lengths().iter();
        match lengths.find(|&&length| length >= longest) {
            Some(length) => Err(TrainingError::Refused(format!(
                "validation.lengths has {length}, but the longest of the validation clips has \
                 {}; give lengths of fewer frames",
                counted(longest, "frame")
            ))),
            None => Ok(Some(Self {
                dataset,
                protocol,
                every_steps: asked.every_steps,
            })),
        }
    }

    /// Whether it is time to score after step `step` of `steps`: the last step is always scored.
    pub fn is_due(&self, step: u64, steps: u64) -> bool {
        step.is_multiple_of(self.every_steps) || step == steps
    }

    /// Scores a model. Draws no random number and moves no weight: a training is the same to the
    /// bit with it and without.
    ///
    /// # Errors
    /// No validation clip is long enough for a length, or the model fails.
    pub fn score(&self, model: &dyn Generator) -> Result<Scores, EvaluationError> {
        let scored = self
            .protocol
            .evaluate(model, self.dataset, DataPart::Validation)?;
        Ok(scored.scores)
    }

    /// What weights are chosen by: the protocol's first metric in its first column.
    pub fn deciding_score(&self, scores: &Scores) -> Option<f64> {
        let metric = self.protocol.metrics().first()?;
        let row = scores.row(metric.key)?;
        row.at(row.columns().next()?)
    }

    /// Whether one such score is better than another.
    pub fn is_better(&self, score: f64, other: f64) -> bool {
        match self.protocol.metrics().first().map(|metric| metric.better) {
            Some(Better::Higher) => score > other,
            _ => score < other,
        }
    }
}

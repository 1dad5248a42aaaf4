//! A model whose predictions move a progress bar.

use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressStyle};

use crate::data::DanceClip;
use crate::evaluation::{EvaluationError, Outcome, Protocol};
use crate::models::ModelError;
use crate::models::transition::windows;
use crate::models::transition::{Transition, TransitionModel, TransitionRequest};

/// Evaluates a model and shows on stderr, where that is a terminal, how far it got.
///
/// # Errors
/// As [`Protocol::evaluate`].
pub fn evaluate_watched(
    protocol: &Protocol,
    model: &dyn TransitionModel,
    clips: &[DanceClip],
) -> Result<Outcome, EvaluationError> {
    let frames: Vec<usize> = clips.iter().map(DanceClip::frames).collect();
    let predicted = protocol
        .lengths
        .iter()
        .map(|&length| (windows(&frames, length).windows.len() * length) as u64);
    let bar = if std::io::stderr().is_terminal() {
        let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}  {eta} left");
        ProgressBar::new(predicted.sum())
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
            .with_message(format!("evaluating {}", model.name()))
    } else {
        ProgressBar::hidden()
    };
    let outcome = protocol.evaluate(&Watched { model, bar: &bar }, clips);
    bar.finish_and_clear();
    outcome
}

struct Watched<'a> {
    model: &'a dyn TransitionModel,
    /// Counts predicted frames.
    bar: &'a ProgressBar,
}

impl TransitionModel for Watched<'_> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn transitions(&self, requests: &[TransitionRequest]) -> Result<Vec<Transition>, ModelError> {
        let transitions = self.model.transitions(requests)?;
        let frames: usize = requests.iter().map(TransitionRequest::length).sum();
        self.bar.inc(frames as u64);
        Ok(transitions)
    }
}

//! A model whose predictions move a progress bar.

use std::io::IsTerminal as _;

use indicatif::{ProgressBar, ProgressStyle};
use ndarray::Array2;

use crate::data::{DataPart, Dataset, Recording};
use crate::evaluation::{Evaluation, EvaluationError, Protocol};
use crate::models::generator::Needs;
use crate::models::{Generator, ModelError, Motion, Request};

/// Evaluates a model and shows on stderr, where that is a terminal, how far it got.
///
/// # Errors
/// As [`Protocol::evaluate`].
pub fn evaluate_watched(
    protocol: &dyn Protocol,
    model: &dyn Generator,
    dataset: &Dataset,
    part: DataPart,
) -> Result<Evaluation, EvaluationError> {
    let recordings = part.of(dataset)?.iter();
    let frames: Vec<usize> = recordings.map(Recording::frames).collect();
    let bar = if std::io::stderr().is_terminal() {
        let style = ProgressStyle::with_template("{wide_bar} {percent:>3} %  {msg}  {eta} left");
        ProgressBar::new(protocol.frames(&frames))
            .with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
            .with_message(format!("evaluating {}", model.name()))
    } else {
        ProgressBar::hidden()
    };
    let evaluation = protocol.evaluate(&Watched { model, bar: &bar }, dataset, part);
    bar.finish_and_clear();
    evaluation
}

struct Watched<'a> {
    model: &'a dyn Generator,
    /// Counts frames that were asked for.
    bar: &'a ProgressBar,
}

impl Watched<'_> {
    fn count<T>(&self, requests: &[Request], answer: T) -> T {
        let frames: usize = requests.iter().map(|request| request.frames).sum();
        self.bar.inc(frames as u64);
        answer
    }
}

impl Generator for Watched<'_> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn needs(&self) -> Needs {
        self.model.needs()
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        Ok(self.count(requests, self.model.generate(requests)?))
    }

    fn raw(&self, requests: &[Request]) -> Result<Vec<Array2<f64>>, ModelError> {
        Ok(self.count(requests, self.model.raw(requests)?))
    }

    fn log_likelihoods(
        &self,
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let answer = self.model.log_likelihoods(requests, truths)?;
        Ok(self.count(requests, answer))
    }
}

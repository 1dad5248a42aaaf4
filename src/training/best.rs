//! The weights of the best validation score so far, which a training may end with.

use super::error::TrainingError;
use super::trainer::Trainer;
use super::validation::Validation;
use crate::autograd::Parameters;
use crate::models::weights::SavedWeights;
use crate::run::{RunError, RunFolder};

/// Weights, and how good they are.
pub(super) struct Best {
    pub step: u64,
    pub parameters: Parameters<f32>,
    /// By the protocol's first metric.
    score: f64,
}

impl Trainer<'_> {
    /// The validation whose best score counts; none where the training ends with its last weights.
    fn deciding(&self) -> Option<&Validation<'_>> {
        let asked = self.config.validation.as_ref();
        let keeps = asked.is_some_and(|asked| asked.keep_best);
        self.validation.as_ref().filter(|_| keeps)
    }

    /// Takes the weights as they are, after step `step`, where their score is better than all
    /// before. The first of equal ones stays.
    pub(super) fn take_best(
        &mut self,
        step: u64,
        score: f64,
        run: Option<&RunFolder>,
    ) -> Result<(), RunError> {
        let Some(validation) = self.deciding() else {
            return Ok(());
        };
        let before = self.best.as_ref().map(|best| best.score);
        if before.is_some_and(|before| !validation.is_better(score, before)) || score.is_nan() {
            return Ok(());
        }
        if let Some(run) = run {
            run.write_best(step, &self.weights_file()?)?;
        }
        self.best = Some(Best {
            step,
            score,
            parameters: self.parameters.clone(),
        });
        Ok(())
    }

    /// The best of what a run has done so far, scored again: a score draws no random number, so it
    /// is what it was.
    pub(super) fn resume_best(&mut self, run: &RunFolder) -> Result<(), TrainingError> {
        let (Some(validation), Some((step, path))) = (self.deciding(), run.best()) else {
            return Ok(());
        };
        let saved = SavedWeights::read(&path).map_err(RunError::from)?;
        let mut parameters = self.parameters.clone();
        let loaded = saved.load_into(&mut parameters, &self.task.statistics());
        loaded.map_err(RunError::from)?;
        let model = self.task.generator(&self.config.name, parameters.clone());
        let scores = self.stepper.install(|| validation.score(&*model));
        let score = scores
            .map_err(|cause| TrainingError::Refused(format!("{}: {cause}", path.display())))
            .map(|scores| validation.deciding_score(&scores))?;
        self.best = score.map(|score| Best {
            step,
            score,
            parameters,
        });
        Ok(())
    }

    /// Puts the best weights in the place of the last; the step that they are of.
    pub(super) fn end_with_best(&mut self) -> Option<u64> {
        let best = self.best.take()?;
        self.parameters = best.parameters;
        Some(best.step)
    }
}

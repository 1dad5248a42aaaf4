//! A model whose answers are watched, and which stops when it is told to.

use ndarray::Array2;

use super::generator::{Needs, Sampling};
use super::{Generator, ModelError, Motion, Request};
use crate::motion::{ContactRule, Mapping};

/// A model that asks before each answer whether to go on, and says how many frames it answered.
pub struct Watched<'a> {
    pub model: &'a dyn Generator,
    /// Where it is true, answers are [`ModelError::Stopped`].
    pub stopped: &'a (dyn Fn() -> bool + Sync),
    /// Is told the frames of each answer, one for each likelihood, by several threads at a time.
    pub answered: &'a (dyn Fn(u64) + Sync),
}

impl Watched<'_> {
    fn watch<T>(
        &self,
        requests: &[Request],
        answer: impl FnOnce() -> Result<T, ModelError>,
    ) -> Result<T, ModelError> {
        self.count(requests.iter().map(|it| it.frames as u64).sum(), answer)
    }

    /// An answer that counts as so many frames.
    fn count<T>(
        &self,
        frames: u64,
        answer: impl FnOnce() -> Result<T, ModelError>,
    ) -> Result<T, ModelError> {
        if (self.stopped)() {
            return Err(ModelError::Stopped);
        }
        let answer = answer()?;
        (self.answered)(frames);
        Ok(answer)
    }
}

impl Generator for Watched<'_> {
    fn name(&self) -> &str {
        self.model.name()
    }

    fn needs(&self) -> Needs {
        self.model.needs()
    }

    #[cfg(feature = "music")]
    fn music_features(&self) -> crate::music::FeatureSet {
        self.model.music_features()
    }

    fn sampling(&self) -> Option<Sampling> {
        self.model.sampling()
    }

    fn reads_given_music(&self) -> bool {
        self.model.reads_given_music()
    }

    fn longest_span(&self) -> Option<usize> {
        self.model.longest_span()
    }

    fn contact_rule(&self) -> ContactRule {
        self.model.contact_rule()
    }

    fn mapping(&self) -> Option<&Mapping> {
        self.model.mapping()
    }

    fn generate(&self, requests: &[Request]) -> Result<Vec<Motion>, ModelError> {
        self.watch(requests, || self.model.generate(requests))
    }

    fn raw(&self, requests: &[Request]) -> Result<Vec<Array2<f64>>, ModelError> {
        self.watch(requests, || self.model.raw(requests))
    }

    fn log_likelihoods(
        &self,
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let answer = || self.model.log_likelihoods(requests, truths);
        self.count(requests.len() as u64, answer)
    }

    fn log_likelihoods_knowing(
        &self,
        known: &[Request],
        requests: &[Request],
        truths: &[Motion],
    ) -> Result<Vec<f64>, ModelError> {
        let ask = || self.model.log_likelihoods_knowing(known, requests, truths);
        self.count(requests.len() as u64, ask)
    }
}

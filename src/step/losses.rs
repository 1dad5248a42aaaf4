//! Losses of a step: those of shards, on whichever rank they were computed, and their sum.

use serde::{Deserialize, Serialize};

use super::error::StepError;
use crate::autograd::{BufferId, Parameters, Tape};
use crate::models::{LossTerms, Watched};
use crate::ranks::Together;

/// Losses of a step or of a shard of it.
#[derive(Debug, Default)]
pub struct Losses {
    pub total: f64,
    /// By name, not weighted.
    pub terms: Vec<(&'static str, f64)>,
    /// New values of buffers.
    pub(super) buffers: Vec<(BufferId, Vec<f64>)>,
    pub watched: Vec<Watched>,
}

impl Losses {
    /// What a tape made of them.
    pub(super) fn read(tape: &Tape<'_, f32>, losses: &LossTerms) -> Self {
        let number = |var| tape.values(var).iter().map(|&x| f64::from(x)).sum::<f64>();
        let terms = losses.terms.iter();
        Self {
            total: number(losses.total),
            terms: terms.map(|&(name, var)| (name, number(var))).collect(),
            buffers: losses.buffers.clone(),
            watched: losses.watched.clone(),
        }
    }

    pub(super) fn are_finite(&self) -> bool {
        self.total.is_finite() && self.terms.iter().all(|(_, x)| x.is_finite())
    }

    /// The sum of all ranks' shards, in the shards' order.
    ///
    /// # Errors
    /// What ended the step on this rank, or else on the first where something did.
    pub(super) fn of_all(
        own: Result<Vec<Self>, StepError>,
        parameters: &Parameters<f32>,
        together: &mut Together,
    ) -> Result<Self, StepError> {
        if together.is_alone() {
            return Ok(own?.into_iter().fold(Self::default(), Self::plus));
        }
        let said = own.as_ref().map(|own| own.iter().map(Said::from).collect());
        let said: Vec<Result<Vec<Said>, Failed>> = together.share(said.map_err(Failed::from))?;
        let like = own?.into_iter().next().unwrap_or_default();
        let mut sum = Self::default();
        for (rank, said) in said.into_iter().enumerate() {
            for said in said.map_err(|failed| failed.on(rank))? {
                sum = sum.plus(said.of(&like, parameters));
            }
        }
        Ok(sum)
    }

    fn plus(mut self, other: Self) -> Self {
        self.total += other.total;
        for ((_, sum), (_, term)) in self.terms.iter_mut().zip(&other.terms) {
            *sum += term;
        }
        if self.terms.is_empty() {
            self.terms = other.terms;
        }
        self.buffers.extend(other.buffers);
        for (watched, other) in self.watched.iter_mut().zip(&other.watched) {
            watched.least = watched.least.min(other.least);
        }
        if self.watched.is_empty() {
            self.watched = other.watched;
        }
        self
    }
}

/// Losses of a shard, as one rank tells them to the others.
#[derive(Serialize, Deserialize)]
struct Said {
    total: f64,
    terms: Vec<f64>,
    /// By their place among the model's buffers.
    buffers: Vec<(usize, Vec<f64>)>,
    watched: Vec<f64>,
}

impl From<&Losses> for Said {
    fn from(losses: &Losses) -> Self {
        let buffers = losses.buffers.iter();
        Self {
            total: losses.total,
            terms: losses.terms.iter().map(|&(_, term)| term).collect(),
            buffers: buffers.map(|(id, to)| (id.place(), to.clone())).collect(),
            watched: losses.watched.iter().map(|watched| watched.least).collect(),
        }
    }
}

impl Said {
    /// Names are those of a shard of this rank; the first always has one.
    fn of(self, like: &Losses, parameters: &Parameters<f32>) -> Losses {
        let names = like.terms.iter().map(|&(name, _)| name);
        let watched = like.watched.iter().zip(self.watched);
        let buffers = self.buffers.into_iter();
        let buffers = buffers.filter_map(|(place, to)| Some((parameters.buffer_at(place)?, to)));
        Losses {
            total: self.total,
            terms: names.zip(self.terms).collect(),
            buffers: buffers.collect(),
            watched: watched
                .map(|(&watched, least)| Watched { least, ..watched })
                .collect(),
        }
    }
}

/// What ended a step, as one rank tells it to the others.
#[derive(Serialize, Deserialize)]
enum Failed {
    Refused(String),
    NonFinite {
        step: u64,
        what: String,
        cause: String,
    },
}

impl From<&StepError> for Failed {
    fn from(error: &StepError) -> Self {
        match error {
            StepError::NonFinite { step, what, cause } => Self::NonFinite {
                step: *step,
                what: what.clone(),
                cause: cause.clone(),
            },
            error => Self::Refused(error.to_string()),
        }
    }
}

impl Failed {
    fn on(self, rank: usize) -> StepError {
        match self {
            Self::Refused(cause) => StepError::Refused(format!("rank {rank}: {cause}")),
            Self::NonFinite { step, what, cause } => StepError::NonFinite {
                step,
                what,
                cause: format!("rank {rank}: {cause}"),
            },
        }
    }
}

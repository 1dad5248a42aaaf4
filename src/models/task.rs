//! What training asks of a model: [`Task`], the steps of a training, and [`Step`], one of them.

use serde_json::{Map, Value};

use super::{Generator, Statistics};
use crate::autograd::{AutogradError, BufferId, Parameters, Real, Tape, Var};

/// What the names of weights begin with that judge the others' output, see [`LossTerms::critics`].
pub const CRITICS: &str = "critics.";

/// The steps of a training. Its weights live in the [`Parameters`] that it was built with.
pub trait Task<T: Real>: Send + Sync {
    /// Optimiser steps of the whole training.
    fn steps(&self) -> u64;

    /// Frames that all its steps train together.
    fn frame_steps(&self) -> u64;

    /// What step `step` (from 0) trains. It follows from the seed and `step` alone, which is what
    /// makes a resumed training end at the same bits.
    fn step(&self, step: u64) -> Box<dyn Step<T> + '_>;

    /// Where a step stands in the task's own schedule, such as epoch and batch: a checkpoint keeps
    /// it, and is refused where its step now stands elsewhere.
    fn place(&self, step: u64) -> [u64; 2] {
        [0, step]
    }

    /// The group of learning rates that a parameter belongs to, see
    /// [`crate::optim::AdamConfig::rates`].
    fn rate_group(&self, _parameter: &str) -> Option<&str> {
        None
    }

    /// Numbers that are saved beside the weights and that the trained model needs, such as means
    /// and deviations of its data.
    fn statistics(&self) -> Statistics {
        Statistics::default()
    }

    /// The model with these weights, which are those that the task was built with.
    fn generator(&self, name: &str, parameters: Parameters<T>) -> Box<dyn Generator>;

    /// The size of the schedule in the task's own words, such as "66 epochs".
    fn summary(&self) -> Option<String> {
        None
    }

    /// What a person should know before it begins.
    fn warnings(&self) -> Vec<String> {
        Vec::new()
    }

    /// What the manifest keeps of the schedule and the training data, by name.
    fn facts(&self) -> Map<String, Value> {
        Map::new()
    }
}

/// One step of a training.
pub trait Step<T: Real>: Send + Sync {
    /// Parts that are computed by themselves, on as many threads as there are; the step's gradient
    /// is their sum.
    fn shards(&self) -> usize;

    /// Frames that the step trains.
    fn frames(&self) -> u64;

    /// The losses of one of its [shards](Step::shards), scaled so that those of all shards add up
    /// to the step's.
    ///
    /// # Errors
    /// Operands that an operation refuses.
    fn losses(&self, tape: &mut Tape<'_, T>, shard: usize) -> Result<LossTerms, AutogradError>;

    /// What its shards do instead where its losses are not theirs alone, such as where a norm's
    /// statistics are those of the whole batch. With one shard [`Step::losses`] counts.
    fn meeting(&self) -> Option<&dyn Meeting<T>> {
        None
    }

    /// The task's own columns of the log, in a fixed order.
    fn columns(&self) -> Vec<(&'static str, Value)> {
        Vec::new()
    }

    /// What it is in an error, such as "16 windows of 30 frames".
    fn describe(&self) -> String;
}

/// A step whose shards compute by themselves up to a place, where they meet.
pub trait Meeting<T: Real>: Send + Sync {
    /// What a shard brings there, `[rows, ..]`.
    ///
    /// # Errors
    /// Operands that an operation refuses.
    fn bring(&self, tape: &mut Tape<'_, T>, shard: usize) -> Result<Var, AutogradError>;

    /// The step's losses by what all shards bring, their rows in the shards' order.
    ///
    /// # Errors
    /// Operands that an operation refuses.
    fn losses(&self, tape: &mut Tape<'_, T>, together: Var) -> Result<LossTerms, AutogradError>;
}

/// Loss terms of a step or of a shard of it, each `[1]`.
#[derive(Debug, Clone)]
pub struct LossTerms {
    /// The weighted sum that is run backwards.
    pub total: Var,
    /// The part of `total` that the weights named [`CRITICS`].. minimise, in an adversarial
    /// training. Their gradients come from it alone, and the gradients of all other weights from
    /// the rest of `total` alone: each side is a constant in the other's part.
    pub critics: Option<Var>,
    /// Terms by name, not weighted, in a fixed order.
    pub terms: Vec<(&'static str, Var)>,
    /// New values of buffers, such as running means, each with as many numbers as the buffer. They
    /// are taken up after the step: where several shards give one buffer's, their mean.
    pub buffers: Vec<(BufferId, Vec<f64>)>,
    /// What to keep an eye on, in a fixed order.
    pub watched: Vec<Watched>,
}

/// A number that says whether a training still goes well: where there are several, the least.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watched {
    pub name: &'static str,
    pub least: f64,
    /// Below this it does not.
    pub bound: f64,
    /// What is wrong then, and what to do.
    pub advice: &'static str,
}

impl LossTerms {
    /// Terms by name with their weights in `total`, each `[1]`; `critics` as the field.
    ///
    /// # Errors
    /// A term of another shape.
    pub fn weighted<T: Real>(
        tape: &mut Tape<'_, T>,
        terms: &[(&'static str, f64, Var)],
        critics: Option<Var>,
    ) -> Result<Self, AutogradError> {
        let mut total = tape.constant_with(&[1], |out| out.fill(T::zero()));
        for &(_, weight, term) in terms {
            let weighted = tape.affine(term, weight, 0.0);
            total = tape.add(total, weighted)?;
        }
        Ok(Self {
            total,
            critics,
            terms: terms.iter().map(|&(name, _, term)| (name, term)).collect(),
            buffers: Vec::new(),
            watched: Vec::new(),
        })
    }
}

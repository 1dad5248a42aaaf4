//! What training asks of a model: loss terms on a tape.

use ndarray::Array3;

use crate::autograd::{AutogradError, Real, Tape, Var};

/// Windows of one length, or a shard of them, as the network reads them.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch<T> {
    /// Standardised features, `[N + 1, windows, 154]`; row 0 is keyframe k1, row N keyframe k2.
    pub features: Array3<T>,
    /// Windows of the whole batch that this is a shard of: losses are means over these.
    pub total_windows: usize,
}

/// What is fed to the network as the current frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Feed {
    /// The true frames (teacher forcing).
    GroundTruth,
    /// The network's own predictions, the gradient flowing back through them.
    Predictions,
}

/// Loss terms of a batch, each `[1]`.
#[derive(Debug, Clone)]
pub struct LossTerms {
    /// The weighted sum that is minimised.
    pub total: Var,
    /// Terms by name, not weighted, in a fixed order.
    pub terms: Vec<(&'static str, Var)>,
}

/// A trainable network; its weights live in the [`crate::autograd::Parameters`] that it was built with.
pub trait Network<T: Real>: Send + Sync {
    /// Loss terms of a batch, divided by its `total_windows`, so that the terms of the shards add up to the batch's.
    ///
    /// # Errors
    /// Features that do not fit the network.
    fn losses(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        feed: Feed,
    ) -> Result<LossTerms, AutogradError>;

    /// Predicts frames k1 + 1 .. k2 from row 0 (all of it), row N (keyframe) and, of the other rows, the root trajectory and
    /// the velocity factors only: standardised `[N, windows, 149]`. The tape computes only, without dropout.
    ///
    /// # Errors
    /// Features that do not fit the network.
    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        features: &Array3<T>,
    ) -> Result<Array3<T>, AutogradError>;
}

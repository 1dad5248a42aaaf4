//! What training asks of a model: loss terms on a tape.

use ndarray::Array3;

use super::pose_windows::PoseWindows;
use crate::autograd::{AutogradError, Real, Tape, Var};

/// What the names of weights begin with that judge the others' output, see [`LossTerms::critics`].
pub const CRITICS: &str = "critics.";

/// Windows of one length, or a shard of them, as the network reads them.
#[derive(Debug, Clone, PartialEq)]
pub struct Batch<T> {
    /// Standardised features, `[N + 1, windows, 154]`; row 0 is keyframe k1, row N keyframe k2.
    pub features: Array3<T>,
    /// The same windows as joint rotations, for a network that [reads](Network::reads_poses) them.
    pub poses: Option<PoseWindows<T>>,
    /// Windows of the whole batch that this is a shard of: losses are means over these.
    pub total_windows: usize,
    /// Frames of other windows, for a network that [asks](Network::single_frames) for them.
    pub single_frames: Vec<SingleFrame<T>>,
    /// Single frames of the whole batch.
    pub total_single_frames: usize,
}

/// A frame with all that is given of its window.
#[derive(Debug, Clone, PartialEq)]
pub struct SingleFrame<T> {
    /// Standardised features of the window, `[N + 1, 1, 154]`, of any N.
    pub window: Array3<T>,
    /// t of frame k1 + t, 1 to N.
    pub frame: usize,
}

impl<T: Real> Batch<T> {
    /// A whole batch of features alone.
    pub fn of(features: Array3<T>) -> Self {
        Self {
            total_windows: features.dim().1,
            features,
            poses: None,
            single_frames: Vec::new(),
            total_single_frames: 0,
        }
    }
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
    /// The weighted sum that is run backwards.
    pub total: Var,
    /// The part of `total` that the weights named [`CRITICS`].. minimise, in an adversarial training. Their gradients come from it
    /// alone, and the gradients of all other weights from the rest of `total` alone: each side is a constant in the other's part.
    pub critics: Option<Var>,
    /// Terms by name, not weighted, in a fixed order.
    pub terms: Vec<(&'static str, Var)>,
}

impl LossTerms {
    /// Terms by name with their weights in `total`, each `[1]`; `critics` as the field.
    pub(crate) fn weighted<T: Real>(
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
        })
    }
}

/// A trainable network; its weights live in the [`crate::autograd::Parameters`] that it was built with.
pub trait Network<T: Real>: Send + Sync {
    /// Whether its batches need [`Batch::poses`].
    fn reads_poses(&self) -> bool {
        false
    }

    /// How many single frames a training step shows it beside its windows.
    fn single_frames(&self) -> usize {
        0
    }

    /// Whether the parameter of this name is a Transformer's, see [`crate::optim::AdamConfig::transformer_learning_rate`].
    fn in_transformer(&self, _parameter: &str) -> bool {
        false
    }

    /// What it is fed at a step for which scheduled sampling drew `drawn`.
    fn feed(&self, drawn: Feed) -> Feed {
        drawn
    }

    /// Loss terms of a batch, divided by its `total_windows` (or `total_single_frames`), so that the terms of the shards add up to the batch's.
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
    fn predict(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>)
    -> Result<Array3<T>, AutogradError>;
}

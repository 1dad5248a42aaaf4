//! What the training of transitions asks of a network: loss terms on a tape.

use ndarray::Array3;

use super::pose_windows::PoseWindows;
use crate::autograd::{AutogradError, Real, Tape};
use crate::models::LossTerms;
use crate::models::generator::Condition;

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
pub enum Forcing {
    /// The true frames.
    Teacher,
    /// The network's own predictions, the gradient flowing back through them.
    FreeRunning,
}

/// A trainable network; its weights live in the [`crate::autograd::Parameters`] that it was built
/// with.
pub trait Network<T: Real>: Send + Sync {
    /// Whether its batches need [`Batch::poses`].
    fn reads_poses(&self) -> bool {
        false
    }

    /// How many single frames a training step shows it beside its windows.
    fn single_frames(&self) -> usize {
        0
    }

    /// The group of learning rates that a parameter belongs to, see
    /// [`crate::optim::AdamConfig::rates`].
    fn rate_group(&self, _parameter: &str) -> Option<&'static str> {
        None
    }

    /// What its predictions follow from beside the two keyframes.
    fn conditions(&self) -> &'static [Condition] {
        &[Condition::RootTrajectory, Condition::VelocityFactors]
    }

    /// What it is fed at a step for which scheduled sampling drew `drawn`.
    fn forcing(&self, drawn: Forcing) -> Forcing {
        drawn
    }

    /// Loss terms of a batch, divided by its `total_windows` (or `total_single_frames`), so that
    /// the terms of the shards add up to the batch's.
    ///
    /// # Errors
    /// Features that do not fit the network.
    fn losses(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
        forcing: Forcing,
    ) -> Result<LossTerms, AutogradError>;

    /// Predicts frames k1 + 1 .. k2 from row 0 (all of it), row N (keyframe) and, of the other
    /// rows, the root trajectory and the velocity factors only: standardised `[N, windows, 149]`.
    /// The tape computes only, without dropout.
    ///
    /// # Errors
    /// Features that do not fit the network.
    fn predict(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>)
    -> Result<Array3<T>, AutogradError>;
}

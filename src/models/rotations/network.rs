//! What the task and the generator of rotations ask of a network.

use super::Batch;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::motion::ContactRule;
use crate::motion::rotation_window::Interpolation;

/// A network that completes windows of rotations; its weights are those of the tape.
pub trait RotationNetwork<T: Real>: Send + Sync {
    /// How its input goes between the keyframes.
    fn input(&self) -> Interpolation;

    /// The losses of a batch with its truth, scaled so that those of all parts of a step add up.
    ///
    /// # Errors
    /// Operands that an operation refuses.
    fn losses(&self, tape: &mut Tape<'_, T>, batch: &Batch<T>) -> Result<LossTerms, AutogradError>;

    /// What it says of the windows of a batch.
    ///
    /// # Errors
    /// Operands that an operation refuses.
    fn predict(
        &self,
        tape: &mut Tape<'_, T>,
        batch: &Batch<T>,
    ) -> Result<Prediction, AutogradError>;

    /// Where the root of its motions comes from.
    fn root(&self) -> RootSource;

    /// Whether it must be given the foot in contact.
    fn needs_contacts(&self) -> bool;

    /// Longest window, frames.
    fn longest(&self) -> usize;

    /// Frames before the first keyframe that it must be given.
    fn past(&self) -> usize {
        0
    }

    /// Most keyframes of a window; what lies between more is made piece by piece.
    fn most_keyframes(&self) -> usize {
        usize::MAX
    }
}

/// What a network says, a row a frame.
#[derive(Debug, Clone, Copy)]
pub struct Prediction {
    /// Y, quaternions (x, y, z, w) of any length, `[rows, 4 J]`.
    pub rotations: Var,
    /// S_c, right and left foot, adding up to 1, `[rows, 2]`.
    pub contacts: Option<Var>,
    /// The root from R_1, `[rows, 3]`, cm.
    pub root: Option<Var>,
}

/// Where a motion's root comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RootSource {
    /// From the network.
    Predicted,
    /// From the feet, by root trajectory reconstruction.
    Reconstructed {
        rule: ContactRule,
        /// The foot in contact is the given one, not that of the larger predicted weight.
        given: bool,
        /// What the root misses the next keyframe by is spread evenly over the frames.
        meets_target: bool,
    },
}

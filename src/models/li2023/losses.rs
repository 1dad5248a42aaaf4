//! Eq. 17 to 21.

use super::network::Output;
use super::{Li2023, Reconstruction, RootWeights, reconstruct_root};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::models::rotations::Batch;

/// Keeps the length of a quaternion of zeros above 0.
const SMALLEST_SQUARE: f64 = 1e-12;

/// The losses of an output, means over the step's windows, their frames and numbers:
///
/// - L_rec (eq. 17): squared differences of Y and Q, or the norm of a frame's;
/// - L_con (eq. 18): both components of the label, for a softmax twice the cross-entropy;
/// - L_p (eq. 19): squared differences of P, positions relative to the root, cm^2;
/// - L_r (eq. 20): squared differences of the reconstructed roots, both from R_1, cm^2.
///
/// # Errors
/// A batch without its truth, or of another body.
pub fn losses<T: Real>(
    network: &Li2023,
    tape: &mut Tape<'_, T>,
    output: Output,
    batch: &Batch<T>,
) -> Result<LossTerms, AutogradError> {
    let weights = &network.settings.loss;
    let truth = batch.truth.as_ref().ok_or(AutogradError::Misplaced {
        operation: "losses",
        what: "the batch has no truth to compare with",
    })?;
    // A shard's share of the mean over all windows of the step.
    let frames = (batch.total_windows * batch.frames) as f64;
    let rotations = tape.constant(truth.rotations.clone());
    let reconstruction = match weights.reconstruction {
        Reconstruction::MeanSquare => mean_square(tape, output.rotations, rotations, frames)?,
        Reconstruction::Norm => {
            let difference = tape.sub(output.rotations, rotations)?;
            let norms = tape.vector_norm(difference, SMALLEST_SQUARE)?;
            let sum = tape.sum(norms);
            tape.affine(sum, 1.0 / frames, 0.0)
        }
    };
    let mut terms = vec![("rec", 1.0, reconstruction)];
    let labels = tape.constant(batch.contacts.clone());
    if weights.contact > 0.0 {
        let logs = tape.log_softmax(output.contact_logits);
        let likely = tape.mul(logs, labels)?;
        let sum = tape.sum(likely);
        terms.push(("con", weights.contact, tape.affine(sum, -2.0 / frames, 0.0)));
    }
    if weights.position > 0.0 || weights.root > 0.0 {
        let offsets = tape.constant(batch.offsets.clone());
        let unit = tape.normalise(output.rotations, 4, SMALLEST_SQUARE)?;
        let own = tape.forward_kinematics(unit, offsets, &network.parents)?;
        let recorded = tape.forward_kinematics(rotations, offsets, &network.parents)?;
        if weights.position > 0.0 {
            let term = scaled_mean_square(tape, own, recorded, frames, network.loss_units[0])?;
            terms.push(("position", weights.position, term));
        }
        if weights.root > 0.0 {
            let softmax = |tape: &mut Tape<'_, T>| match network.settings.rtr.weights {
                RootWeights::PredictedSoft if network.settings.predicts_contacts() => {
                    tape.softmax(output.contact_logits)
                }
                _ => labels,
            };
            let contacts = softmax(tape);
            let root = root_of(network, tape, own, contacts, batch.frames)?;
            let target = root_of(network, tape, recorded, labels, batch.frames)?;
            let term = scaled_mean_square(tape, root, target, frames, network.loss_units[1])?;
            terms.push(("root", weights.root, term));
        }
    }
    LossTerms::weighted(tape, &terms, None)
}

/// The root reconstructed from positions `[rows, 3 J]`.
fn root_of<T: Real>(
    network: &Li2023,
    tape: &mut Tape<'_, T>,
    positions: Var,
    weights: Var,
    frames: usize,
) -> Result<Var, AutogradError> {
    let [right, left] = network.feet.map(|joint| 3 * joint..3 * joint + 3);
    let feet = [
        tape.columns(positions, right)?,
        tape.columns(positions, left)?,
    ];
    reconstruct_root(tape, feet, weights, frames)
}

/// Sum of squared differences over frames and numbers of a frame.
fn mean_square<T: Real>(
    tape: &mut Tape<'_, T>,
    x: Var,
    target: Var,
    frames: f64,
) -> Result<Var, AutogradError> {
    let numbers = tape.shape(x).last().copied().unwrap_or(1).max(1) as f64;
    let difference = tape.sub(x, target)?;
    let squares = tape.square(difference);
    let sum = tape.sum(squares);
    Ok(tape.affine(sum, 1.0 / (frames * numbers), 0.0))
}

/// The same of lengths measured in `unit` cm.
fn scaled_mean_square<T: Real>(
    tape: &mut Tape<'_, T>,
    x: Var,
    target: Var,
    frames: f64,
    unit: f64,
) -> Result<Var, AutogradError> {
    let term = mean_square(tape, x, target, frames)?;
    Ok(tape.affine(term, 1.0 / (unit * unit), 0.0))
}

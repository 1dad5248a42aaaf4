//! The loss functions, eq. 3 to 11, on standardised predictions.
//!
//! Each term is summed over the numbers of a frame and averaged over the N frames and the windows,
//! as the equations print them. z is a standardised quantity, ~ marks a prediction; s_p and s_v are
//! the root mean squares of the standard deviations of p^b (cm) and v^b (cm/frame).

use super::config::Pan2021Config;
use super::units::{Units, VELOCITIES, constant, lengths_of};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::models::transition::Batch;
use crate::motion::JOINTS;
use crate::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, FEATURES, FRAME, ROOT_POSITION,
    VELOCITY_FACTORS,
};

/// p^b and p^r.
const POSITIONS: std::ops::Range<usize> = 0..ROOT_POSITION.end;
/// p^r and o^r.
const ROOT: std::ops::Range<usize> = ROOT_POSITION.start..FACING.end;

/// A batch's frames on the tape, in rows of one frame of one window, `[N * windows, ..]`.
struct Frames {
    /// Predictions of frames k1 + 1 .. k2, `[rows, 149]`.
    predicted: Var,
    /// The frames before them: the true k1, then predictions, `[rows, 149]`.
    before: Var,
    transition: usize,
    windows: usize,
}

/// What was predicted of a batch.
pub(super) struct Predicted<'f> {
    /// The true frame k1 and the predictions of k1 + 1 .. k2, each `[windows, 149]`.
    pub frames: &'f [Var],
    /// The loss of the single frames, `[1]`, where the network has a path for them.
    pub single_frames: Option<Var>,
}

/// All terms.
pub(super) fn terms<T: Real>(
    tape: &mut Tape<'_, T>,
    units: &Units,
    config: &Pan2021Config,
    batch: &Batch<T>,
    Predicted {
        frames,
        single_frames,
    }: Predicted<'_>,
) -> Result<LossTerms, AutogradError> {
    let (transition, windows) = (frames.len() - 1, batch.features.dim().1);
    let flat = [transition * windows, FRAME];
    let predicted = tape.stack(&frames[1..])?;
    let before = tape.stack(&frames[..transition])?;
    let frames = Frames {
        predicted: tape.reshape(predicted, &flat)?,
        before: tape.reshape(before, &flat)?,
        transition,
        windows,
    };
    // The mean over frames and windows.
    let mean = 1.0 / (transition * batch.total_windows) as f64;
    let weights = config.loss;
    let velocities = tape.columns(frames.predicted, VELOCITIES)?;
    let velocities = units.velocities(tape, velocities)?;

    let rec = reconstruction(tape, &frames, batch)?;
    let bone = bone_length(tape, units, &frames, batch)?;
    let contact = contact(tape, units, &frames)?;
    let velocity = velocity_consistency(tape, units, &frames, velocities)?;
    let root = root_smoothness(tape, &frames)?;
    let key = keyframe(tape, &frames, batch, weights.key_frames)?;
    let mut all = vec![
        ("rec", weights.rec, tape.affine(rec, mean, 0.0)),
        ("bone", weights.con, tape.affine(bone, mean, 0.0)),
        ("contact", weights.con * weights.contact, {
            tape.affine(contact, mean, 0.0)
        }),
        ("velocity", weights.con, tape.affine(velocity, mean, 0.0)),
        ("root", weights.root, tape.affine(root, mean, 0.0)),
        // The weights of eq. 10 hold the mean over the frames.
        ("key", weights.key, {
            tape.affine(key, 1.0 / batch.total_windows as f64, 0.0)
        }),
    ];
    if config.velocity_factor {
        let vfac = velocity_factor(tape, units, batch, velocities)?;
        all.push(("vfac", weights.vfac, tape.affine(vfac, mean, 0.0)));
    }
    if let Some(loss) = single_frames {
        all.push(("single_frames", weights.single_frames, loss));
    }
    LossTerms::weighted(tape, &all, None)
}

/// The true numbers of frames k1 + 1 .. k2, `[rows, columns]`.
fn truth<T: Real>(
    tape: &mut Tape<'_, T>,
    batch: &Batch<T>,
    columns: std::ops::Range<usize>,
) -> Var {
    let (frames, windows, _) = batch.features.dim();
    let rows = (frames - 1) * windows;
    tape.constant_with(&[rows, columns.len()], |out| {
        let frames = batch.features.as_slice().unwrap_or(&[]);
        let frames = frames.chunks_exact(FEATURES).skip(windows);
        for (out, frame) in out.chunks_exact_mut(columns.len()).zip(frames) {
            out.copy_from_slice(&frame[columns.clone()]);
        }
    })
}

fn sum_of_squares<T: Real>(tape: &mut Tape<'_, T>, x: Var) -> Var {
    let squares = tape.square(x);
    tape.sum(squares)
}

/// L_rec, eq. 4: sum over all 149 numbers of (z~ - z)^2; standardised.
fn reconstruction<T: Real>(
    tape: &mut Tape<'_, T>,
    frames: &Frames,
    batch: &Batch<T>,
) -> Result<Var, AutogradError> {
    let truth = truth(tape, batch, 0..FRAME);
    let difference = tape.sub(frames.predicted, truth)?;
    Ok(sum_of_squares(tape, difference))
}

/// L_bone, eq. 6: sum over bones of ((length~ - length) / s_p)^2, the length that of keyframe k1;
/// in units of s_p.
fn bone_length<T: Real>(
    tape: &mut Tape<'_, T>,
    units: &Units,
    frames: &Frames,
    batch: &Batch<T>,
) -> Result<Var, AutogradError> {
    let positions = tape.columns(frames.predicted, BODY_POSITIONS)?;
    let lengths = units.bone_lengths(tape, positions)?;
    let first = batch.features.index_axis(ndarray::Axis(0), 0);
    let wanted: Vec<f64> = first
        .rows()
        .into_iter()
        .flat_map(|row| {
            let standardised: Vec<f64> = row.iter().map(|&x| Real::to_f64(x)).collect();
            lengths_of(&units.body_positions(&standardised))
        })
        .collect();
    let bones = JOINTS - 1;
    let lengths = tape.reshape(lengths, &[frames.transition, frames.windows, bones])?;
    let wanted = constant(tape, &[frames.windows, bones], &wanted);
    let difference = tape.sub(lengths, wanted)?;
    let difference = tape.affine(difference, 1.0 / units.position_scale, 0.0);
    Ok(sum_of_squares(tape, difference))
}

/// L_contact, eq. 7: sum over foot joints of c~ |v~| / s_v, with c~ clamped to [0, 1]; in units of
/// s_v.
fn contact<T: Real>(
    tape: &mut Tape<'_, T>,
    units: &Units,
    frames: &Frames,
) -> Result<Var, AutogradError> {
    let labels = tape.columns(frames.predicted, CONTACTS)?;
    let std = constant(tape, &[4], &units.contact_std);
    let mean = constant(tape, &[4], &units.contact_mean);
    let labels = tape.mul(labels, std)?;
    let labels = tape.add(labels, mean)?;
    let labels = tape.clamp(labels, 0.0, 1.0);
    let velocities = tape.columns(frames.predicted, BODY_VELOCITIES)?;
    let speeds = units.foot_speeds(tape, velocities)?;
    let product = tape.mul(labels, speeds)?;
    let sum = tape.sum(product);
    Ok(tape.affine(sum, 1.0 / units.velocity_scale, 0.0))
}

/// L_velocity, eq. 8: sum over all joints of |v~_t - (p~_t - p~_{t-1})|^2 / s_v^2; in units of s_v.
/// `velocities` in cm/frame.
fn velocity_consistency<T: Real>(
    tape: &mut Tape<'_, T>,
    units: &Units,
    frames: &Frames,
    velocities: Var,
) -> Result<Var, AutogradError> {
    let now = tape.columns(frames.predicted, POSITIONS)?;
    let before = tape.columns(frames.before, POSITIONS)?;
    let moved = tape.sub(now, before)?;
    let std = constant(tape, &[POSITIONS.len()], &units.position_std);
    let moved = tape.mul(moved, std)?;
    let difference = tape.sub(velocities, moved)?;
    let difference = tape.affine(difference, 1.0 / units.velocity_scale, 0.0);
    Ok(sum_of_squares(tape, difference))
}

/// L_root, eq. 9: sum over p^r, o^r of (z~_t - z~_{t-1})^2; standardised.
fn root_smoothness<T: Real>(tape: &mut Tape<'_, T>, frames: &Frames) -> Result<Var, AutogradError> {
    let now = tape.columns(frames.predicted, ROOT)?;
    let before = tape.columns(frames.before, ROOT)?;
    let difference = tape.sub(now, before)?;
    Ok(sum_of_squares(tape, difference))
}

/// Weights of frame t (1 .. N after k1) for k1 and k2 in eq. 10.
///
/// In the second case (N <= 2m) the printed weights pull frames near k2 towards k1; the ones here
/// pull to the nearer keyframe.
pub fn keyframe_weights(t: usize, transition: usize, m: usize) -> (f64, f64) {
    let n = transition as f64;
    if transition > 2 * m {
        let each = 1.0 / (2 * m) as f64;
        let near_first = if t <= m { each } else { 0.0 };
        let near_last = if t > transition - m { each } else { 0.0 };
        (near_first, near_last)
    } else {
        let share = t as f64 / n;
        ((1.0 - share) / n, share / n)
    }
}

/// L_key, eq. 10: weighted sums over p^b, p^r of (z~ - z_k1)^2 and (z~ - z_k2)^2; standardised,
/// already the mean over frames.
fn keyframe<T: Real>(
    tape: &mut Tape<'_, T>,
    frames: &Frames,
    batch: &Batch<T>,
    m: usize,
) -> Result<Var, AutogradError> {
    let (n, windows) = (frames.transition, frames.windows);
    let positions = tape.columns(frames.predicted, POSITIONS)?;
    let positions = tape.reshape(positions, &[n, windows, POSITIONS.len()])?;
    let weights: Vec<(f64, f64)> = (1..=n).map(|t| keyframe_weights(t, n, m)).collect();
    let mut total = tape.constant_with(&[1], |out| out.fill(T::zero()));
    for (frame, of) in [
        (0, weights.iter().map(|w| w.0).collect::<Vec<_>>()),
        (n, weights.iter().map(|w| w.1).collect()),
    ] {
        let keyframe = batch.features.index_axis(ndarray::Axis(0), frame);
        let keyframe = tape.constant_with(&[windows, POSITIONS.len()], |out| {
            let rows = keyframe.rows();
            for (out, row) in out.chunks_exact_mut(POSITIONS.len()).zip(rows) {
                out.iter_mut().zip(row).for_each(|(out, &x)| *out = x);
            }
        });
        let difference = tape.sub(positions, keyframe)?;
        let squares = tape.square(difference);
        let of = constant(tape, &[n, 1, 1], &of);
        let weighted = tape.mul(squares, of)?;
        let sum = tape.sum(weighted);
        total = tape.add(total, sum)?;
    }
    Ok(total)
}

/// L_vfac, eq. 11: sum over the five parts of (z(f~) - z(f^))^2, f~ by eq. 1 from the predicted
/// velocities; standardised.
fn velocity_factor<T: Real>(
    tape: &mut Tape<'_, T>,
    units: &Units,
    batch: &Batch<T>,
    velocities: Var,
) -> Result<Var, AutogradError> {
    let factors = units.velocity_factors(tape, velocities)?;
    let wanted = truth(tape, batch, VELOCITY_FACTORS);
    let difference = tape.sub(factors, wanted)?;
    Ok(sum_of_squares(tape, difference))
}

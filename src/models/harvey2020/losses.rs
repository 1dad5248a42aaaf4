//! The losses: mean absolute differences from the recorded motion, and what the critics add.

use super::config::RecurrentConfig;
use super::critic::{Critic, judge};
use super::given::{GivenWindows, Recorded};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;

/// The unit of differences of quaternions: from k1 on, they change by about this where joints move
/// by s_p (the mean over windows of 5 to 70 frames of the dance data's training clips).
const QUATERNION_UNIT: f64 = 0.07;

/// Units of the network's numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales {
    /// s_p, of joints' positions, cm.
    pub position: f64,
    /// s_v, of joints' velocities, cm/frame.
    pub velocity: f64,
    /// Of the root's offset to the target, cm.
    pub root: f64,
    /// Of the root's velocity, cm/frame.
    pub root_velocity: f64,
}

/// Frames k1 .. k2 on the tape, in the windows' frames: `[windows, ..]` each, k1 as recorded.
#[derive(Debug, Clone, Default)]
pub(super) struct PredictedFrames {
    /// `[windows, 4 J]`
    pub(super) rotations: Vec<Var>,
    /// `[windows, 3]`, cm
    pub(super) roots: Vec<Var>,
    /// `[windows, 4]`, in 0 to 1
    pub(super) contacts: Vec<Var>,
}

/// The same in rows of one frame of one window, `[(N + 1) * windows, ..]`.
struct Frames {
    rotations: Var,
    roots: Var,
    contacts: Var,
    /// Joints relative to the root, `[rows, 3 J]`, cm.
    relative: Var,
    /// Joints where the root is, `[rows, 3 J]`, cm.
    placed: Var,
}

impl Frames {
    fn new<T: Real>(
        tape: &mut Tape<'_, T>,
        motion: &PredictedFrames,
        given: &GivenWindows<T>,
    ) -> Result<Self, AutogradError> {
        let rows = motion.roots.len() * given.windows;
        let mut flat = |parts: &[Var], columns: usize| {
            let stacked = tape.stack(parts)?;
            tape.reshape(stacked, &[rows, columns])
        };
        let joint_count = given.parents.len();
        let rotations = flat(&motion.rotations, 4 * joint_count)?;
        let roots = flat(&motion.roots, 3)?;
        let contacts = flat(&motion.contacts, 4)?;
        let relative = joints(tape, given, rotations)?;
        let (joints, root) = (
            tape.reshape(relative, &[rows, joint_count, 3])?,
            tape.reshape(roots, &[rows, 1, 3])?,
        );
        let placed = tape.add(joints, root)?;
        Ok(Self {
            rotations,
            roots,
            contacts,
            relative,
            placed: tape.reshape(placed, &[rows, 3 * joint_count])?,
        })
    }

    /// What the critics see of frames k1 + 1 .. k2, `[N * windows, 6 J - 3]`: joints relative to
    /// the root in units of s_p, velocities in units of s_v.
    fn seen<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        windows: usize,
        scales: Scales,
    ) -> Result<Var, AutogradError> {
        let (rows, columns) = (tape.shape(self.relative)[0], tape.shape(self.relative)[1]);
        let joints = tape.rows(self.relative, windows..rows)?;
        let joints = tape.columns(joints, 3..columns)?;
        let joints = tape.affine(joints, 1.0 / scales.position, 0.0);
        let now = tape.rows(self.placed, windows..rows)?;
        let before = tape.rows(self.placed, 0..rows - windows)?;
        let velocities = tape.sub(now, before)?;
        let velocities = tape.affine(velocities, 1.0 / scales.velocity, 0.0);
        tape.concat(&[joints, velocities])
    }
}

/// Forward kinematics of `rotations [n * windows, 4 J]`: joints relative to the root,
/// `[n * windows, 3 J]`, cm.
pub(super) fn joints<T: Real>(
    tape: &mut Tape<'_, T>,
    given: &GivenWindows<T>,
    rotations: Var,
) -> Result<Var, AutogradError> {
    let offsets = constant(tape, given.windows, &given.offsets);
    tape.forward_kinematics(rotations, offsets, &given.parents)
}

/// A constant `[windows, columns]`.
pub(super) fn constant<T: Real>(tape: &mut Tape<'_, T>, windows: usize, values: &[T]) -> Var {
    let columns = values.len() / windows.max(1);
    tape.constant_with(&[windows, columns], |out| out.copy_from_slice(values))
}

/// The recorded motion.
pub(super) fn recorded<T: Real>(
    tape: &mut Tape<'_, T>,
    recorded: &Recorded<T>,
    windows: usize,
) -> PredictedFrames {
    let mut frames = |of: &[Vec<T>]| -> Vec<Var> {
        of.iter()
            .map(|numbers| constant(tape, windows, numbers))
            .collect()
    };
    PredictedFrames {
        rotations: frames(&recorded.rotations),
        roots: frames(&recorded.roots),
        contacts: frames(&recorded.contacts),
    }
}

/// All terms of a predicted motion; `total_windows` as in [`crate::models::transition::Batch`].
///
/// - quaternion: mean of |q~ - q| over the 4 J numbers, in units of 0.07;
/// - root: mean of |r~ - r| over the 3 numbers, in units of s_p;
/// - position: mean of |p~ - p| over the 3 J numbers of all joints with the root where it is, in
///   units of s_p;
/// - contact: mean of |c~ - c| over the 4 labels;
/// - adversarial, critics: see [`super::critic::Judgement`], with critics only.
pub(super) fn terms<T: Real>(
    tape: &mut Tape<'_, T>,
    config: &RecurrentConfig,
    scales: Scales,
    critics: &[Critic],
    given: &GivenWindows<T>,
    [predicted, recorded]: [&PredictedFrames; 2],
    total_windows: usize,
) -> Result<LossTerms, AutogradError> {
    let recorded = Frames::new(tape, recorded, given)?;
    let predicted = Frames::new(tape, predicted, given)?;
    let frames = given.transition * total_windows;
    // Keyframe k1 stands on both sides and adds nothing.
    let mut distance = |a: Var, b: Var, unit: f64| -> Result<Var, AutogradError> {
        let columns = tape.shape(a).last().copied().unwrap_or(0);
        let difference = tape.sub(a, b)?;
        let sizes = tape.abs(difference);
        let sum = tape.sum(sizes);
        Ok(tape.affine(sum, 1.0 / (unit * (frames * columns) as f64), 0.0))
    };
    let quaternion = distance(predicted.rotations, recorded.rotations, QUATERNION_UNIT)?;
    let root = distance(predicted.roots, recorded.roots, scales.position)?;
    let position = distance(predicted.placed, recorded.placed, scales.position)?;
    let contact = distance(predicted.contacts, recorded.contacts, 1.0)?;
    let weights = config.loss;
    let mut all = vec![
        ("quaternion", weights.quaternion, quaternion),
        ("root", weights.root, root),
        ("position", weights.position, position),
        ("contact", weights.contact, contact),
    ];
    let mut critics_part = None;
    if config.adversarial {
        let seen = [
            predicted.seen(tape, given.windows, scales)?,
            recorded.seen(tape, given.windows, scales)?,
        ];
        let judgement = judge(tape, critics, seen, given.windows, total_windows)?;
        all.push(("adversarial", weights.adversarial, judgement.generator));
        all.push(("critics", 1.0, judgement.critics));
        critics_part = Some(judgement.critics);
    }
    LossTerms::weighted(tape, &all, critics_part)
}

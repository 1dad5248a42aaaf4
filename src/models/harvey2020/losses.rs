//! The losses: mean absolute differences from the recorded motion, and what the critics add.

use super::config::Harvey2020Config;
use super::critic::{Critic, judge};
use super::given::GivenWindows;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::LossTerms;
use crate::models::transition::pose_windows::{OFFSETS, ROTATIONS};
use crate::motion::{DANCE_PARENTS, JOINTS};

/// The unit of differences of quaternions: from k1 on, they change by about this where joints move
/// by s_p (the mean over windows of 5 to 70 frames of the dance data's training clips).
const QUATERNION_UNIT: f64 = 0.07;

/// s_p (cm) and s_v (cm/frame), the scales of p^b and v^b.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scales {
    pub(super) position: f64,
    pub(super) velocity: f64,
}

/// Frames k1 .. k2 on the tape, in the windows' frames: `[windows, ..]` each, k1 as recorded.
#[derive(Debug, Clone, Default)]
pub(super) struct PredictedFrames {
    /// `[windows, 96]`
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
    /// Joints relative to the root, `[rows, 72]`, cm.
    relative: Var,
    /// Joints where the root is, `[rows, 72]`, cm.
    placed: Var,
}

impl Frames {
    fn new<T: Real>(
        tape: &mut Tape<'_, T>,
        motion: &PredictedFrames,
        given: &GivenWindows<'_, T>,
    ) -> Result<Self, AutogradError> {
        let rows = motion.roots.len() * given.windows;
        let mut flat = |parts: &[Var], columns: usize| {
            let stacked = tape.stack(parts)?;
            tape.reshape(stacked, &[rows, columns])
        };
        let rotations = flat(&motion.rotations, ROTATIONS)?;
        let roots = flat(&motion.roots, 3)?;
        let contacts = flat(&motion.contacts, 4)?;
        let relative = joints(tape, given, rotations)?;
        let (joints, root) = (
            tape.reshape(relative, &[rows, JOINTS, 3])?,
            tape.reshape(roots, &[rows, 1, 3])?,
        );
        let placed = tape.add(joints, root)?;
        Ok(Self {
            rotations,
            roots,
            contacts,
            relative,
            placed: tape.reshape(placed, &[rows, 3 * JOINTS])?,
        })
    }

    /// What the critics see of frames k1 + 1 .. k2, `[N * windows, 141]`: joints relative to the
    /// root in units of s_p, velocities in units of s_v.
    fn seen<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        windows: usize,
        scales: Scales,
    ) -> Result<Var, AutogradError> {
        let rows = tape.shape(self.relative)[0];
        let joints = tape.rows(self.relative, windows..rows)?;
        let joints = tape.columns(joints, 3..3 * JOINTS)?;
        let joints = tape.affine(joints, 1.0 / scales.position, 0.0);
        let now = tape.rows(self.placed, windows..rows)?;
        let before = tape.rows(self.placed, 0..rows - windows)?;
        let velocities = tape.sub(now, before)?;
        let velocities = tape.affine(velocities, 1.0 / scales.velocity, 0.0);
        tape.concat(&[joints, velocities])
    }
}

/// Forward kinematics of `rotations [n * windows, 96]`: joints relative to the root,
/// `[n * windows, 72]`, cm.
pub(super) fn joints<T: Real>(
    tape: &mut Tape<'_, T>,
    given: &GivenWindows<'_, T>,
    rotations: Var,
) -> Result<Var, AutogradError> {
    let offsets = tape.constant_with(&[given.windows, OFFSETS], |out| {
        let offsets = given.poses.offsets.iter();
        out.iter_mut().zip(offsets).for_each(|(out, &x)| *out = x);
    });
    tape.forward_kinematics(rotations, offsets, &DANCE_PARENTS)
}

/// A constant `[windows, columns]`.
pub(super) fn constant<T: Real>(tape: &mut Tape<'_, T>, windows: usize, values: &[T]) -> Var {
    let columns = values.len() / windows.max(1);
    tape.constant_with(&[windows, columns], |out| out.copy_from_slice(values))
}

/// The recorded motion.
fn recorded<T: Real>(tape: &mut Tape<'_, T>, given: &GivenWindows<'_, T>) -> PredictedFrames {
    let mut frames = |of: &dyn Fn(usize) -> Vec<T>| -> Vec<Var> {
        (0..=given.transition)
            .map(|row| constant(tape, given.windows, &of(row)))
            .collect()
    };
    PredictedFrames {
        rotations: frames(&|row| given.rotations(row)),
        roots: frames(&|row| given.roots(row)),
        contacts: frames(&|row| given.contacts(row)),
    }
}

/// All terms of a predicted motion; `total_windows` as in [`crate::models::transition::Batch`].
///
/// - quaternion: mean of |q~ - q| over the 96 numbers, in units of 0.07;
/// - root: mean of |r~ - r| over the 3 numbers, in units of s_p;
/// - position: mean of |p~ - p| over the 72 numbers of all joints with the root where it is, in
///   units of s_p;
/// - contact: mean of |c~ - c| over the 4 labels;
/// - adversarial, critics: see [`super::critic::Judgement`], with critics only.
pub(super) fn terms<T: Real>(
    tape: &mut Tape<'_, T>,
    config: &Harvey2020Config,
    scales: Scales,
    critics: &[Critic],
    given: &GivenWindows<'_, T>,
    predicted: &PredictedFrames,
    total_windows: usize,
) -> Result<LossTerms, AutogradError> {
    let recorded = recorded(tape, given);
    let recorded = Frames::new(tape, &recorded, given)?;
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

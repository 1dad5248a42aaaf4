//! From standardised numbers to centimetres on the tape: velocity factors, bone vectors, foot
//! velocities.

use glam::DVec3;
use ndarray::Array2;

use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::transition::Standardisation;
use crate::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, CONTACTS, FACING, ROOT_VELOCITY, VELOCITY_FACTORS,
};
use crate::motion::velocity_factor::{PART_WEIGHTS, PARTS};
use crate::motion::{DANCE_PARENTS, JOINTS};

/// Keeps the gradient of a norm finite at 0; in the square of the quantity's own unit.
pub(super) const NORM_EPS: f64 = 1e-8;
/// LeftFoot, LeftToeBase, RightFoot, RightToeBase, as the contact labels.
const FEET: [usize; 4] = [3, 4, 7, 8];
/// Numbers of v^b and v^r.
pub(super) const VELOCITIES: std::ops::Range<usize> = BODY_VELOCITIES.start..ROOT_VELOCITY.end;

/// An affine map of standardised numbers, `[out, in]` and `[out]`.
#[derive(Debug, Clone)]
struct Affine {
    weight: Array2<f64>,
    bias: Vec<f64>,
}

impl Affine {
    fn forward<T: Real>(&self, tape: &mut Tape<'_, T>, x: Var) -> Result<Var, AutogradError> {
        let (outputs, inputs) = self.weight.dim();
        let weight = constant(tape, &[outputs, inputs], &self.weight);
        let bias = constant(tape, &[outputs], &self.bias);
        tape.linear(x, weight, Some(bias), false)
    }
}

/// A constant from f64 numbers.
pub(super) fn constant<'v, T: Real>(
    tape: &mut Tape<'_, T>,
    shape: &[usize],
    values: impl IntoIterator<Item = &'v f64>,
) -> Var {
    tape.constant_with(shape, |out| {
        for (out, &x) in out.iter_mut().zip(values) {
            *out = T::from_f64(x);
        }
    })
}

/// What of a data set's statistics the network computes with.
#[derive(Debug, Clone)]
pub(super) struct Units {
    /// Standard deviation and mean of v^b, v^r (72).
    velocity_std: Vec<f64>,
    velocity_mean: Vec<f64>,
    /// Standard deviation of p^b, p^r (72).
    pub(super) position_std: Vec<f64>,
    /// Mean and standard deviation of o^r, rad.
    facing_mean: f64,
    pub(super) facing_std: f64,
    /// Standard deviation of v^r on the floor, cm/frame, the same in every direction.
    pub(super) floor_speed: f64,
    /// Mean of p^b (69).
    body_mean: Vec<f64>,
    pub(super) contact_std: Vec<f64>,
    pub(super) contact_mean: Vec<f64>,
    /// Speeds of joints 1 .. 23 and the root, `[24]`, to standardised velocity factors `[5]` (eq.
    /// 1).
    factors: Affine,
    /// p^b standardised to the vectors of the 23 bones, `[69]`, cm.
    bones: Affine,
    /// v^b standardised to the velocities of the four foot joints, `[12]`, cm/frame.
    feet: Affine,
    pub(super) position_scale: f64,
    pub(super) velocity_scale: f64,
}

impl Units {
    pub(super) fn new(standardisation: &Standardisation) -> Self {
        let (mean, std) = (&standardisation.mean, &standardisation.std);
        let positions = BODY_POSITIONS;
        let velocities = BODY_VELOCITIES;
        Self {
            velocity_std: std[VELOCITIES].to_vec(),
            velocity_mean: mean[VELOCITIES].to_vec(),
            position_std: std[..VELOCITIES.len()].to_vec(),
            facing_mean: mean[FACING.start],
            facing_std: std[FACING.start],
            floor_speed: std[ROOT_VELOCITY.start].hypot(std[ROOT_VELOCITY.start + 2])
                / std::f64::consts::SQRT_2,
            body_mean: mean[BODY_POSITIONS].to_vec(),
            contact_std: std[CONTACTS].to_vec(),
            contact_mean: mean[CONTACTS].to_vec(),
            factors: factor_map(&mean[VELOCITY_FACTORS], &std[VELOCITY_FACTORS]),
            bones: restored(&bone_map(), &mean[positions.clone()], &std[positions]),
            feet: restored(&foot_map(), &mean[velocities.clone()], &std[velocities]),
            position_scale: standardisation.position_scale,
            velocity_scale: standardisation.velocity_scale,
        }
    }

    /// o^r from its standardised number, rad.
    pub(super) fn facing<T: Real>(&self, standardised: T) -> T {
        standardised * T::from_f64(self.facing_std) + T::from_f64(self.facing_mean)
    }

    /// p^b in cm of one standardised frame.
    pub(super) fn body_positions(&self, frame: &[f64]) -> Vec<f64> {
        BODY_POSITIONS
            .map(|i| frame[i] * self.position_std[i] + self.body_mean[i])
            .collect()
    }

    /// A standardised velocity of p^b or p^r, `number` 0 to 71, in standard deviations of the
    /// position a frame.
    fn speed<T: Real>(&self, number: usize, standardised: T) -> T {
        let [scale, offset] = self.speed_map(number);
        (standardised - T::from_f64(offset)) / T::from_f64(scale)
    }

    /// The inverse of [`Units::speed`].
    pub(super) fn standardised_speed<T: Real>(&self, number: usize, speed: T) -> T {
        let [scale, offset] = self.speed_map(number);
        speed * T::from_f64(scale) + T::from_f64(offset)
    }

    /// Number `number` of p^b of keyframe k1, its velocity there and p^b of k2, in standard
    /// deviations of p^b, from their frames.
    pub(super) fn ends<T: Real>(&self, number: usize, first: &[T], last: &[T]) -> [T; 3] {
        let speed = self.speed(number, first[VELOCITIES.start + number]);
        [first[number], speed, last[number]]
    }

    /// v^b for changes of p^b a frame, `[rows, 69]`, both standardised: a difference of velocities,
    /// so means do not count.
    pub(super) fn speed_changes<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        changes: Var,
    ) -> Result<Var, AutogradError> {
        let scales: Vec<f64> = BODY_POSITIONS.map(|i| self.speed_map(i)[0]).collect();
        let scales = constant(tape, &[scales.len()], &scales);
        tape.mul(changes, scales)
    }

    /// Differences of p^b in s_p, the same length for every number, from standardised ones,
    /// `[rows, 69]`.
    pub(super) fn in_scale<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        differences: Var,
    ) -> Result<Var, AutogradError> {
        let scales: Vec<f64> = BODY_POSITIONS
            .map(|i| self.position_std[i] / self.position_scale)
            .collect();
        let scales = constant(tape, &[scales.len()], &scales);
        tape.mul(differences, scales)
    }

    /// Scale and offset from position deviations a frame to a standardised velocity.
    fn speed_map(&self, number: usize) -> [f64; 2] {
        let std = self.velocity_std[number];
        [
            self.position_std[number] / std,
            -self.velocity_mean[number] / std,
        ]
    }

    /// Velocities in cm/frame from standardised ones, `[.., 72]`.
    pub(super) fn velocities<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        standardised: Var,
    ) -> Result<Var, AutogradError> {
        let n = self.velocity_std.len();
        let std = constant(tape, &[n], &self.velocity_std);
        let mean = constant(tape, &[n], &self.velocity_mean);
        let scaled = tape.mul(standardised, std)?;
        tape.add(scaled, mean)
    }

    /// Eq. 1 on velocities in cm/frame `[rows, 72]`: standardised velocity factors `[rows, 5]`.
    pub(super) fn velocity_factors<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        velocities: Var,
    ) -> Result<Var, AutogradError> {
        let rows = tape.shape(velocities)[0];
        let joints = tape.reshape(velocities, &[rows, JOINTS, 3])?;
        let speeds = tape.vector_norm(joints, NORM_EPS)?;
        self.factors.forward(tape, speeds)
    }

    /// Lengths of the 23 bones, `[rows, 23]`, cm, from standardised p^b `[rows, 69]`; the root is
    /// at 0.
    pub(super) fn bone_lengths<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        positions: Var,
    ) -> Result<Var, AutogradError> {
        let vectors = self.bones.forward(tape, positions)?;
        norms(tape, vectors, JOINTS - 1)
    }

    /// Speeds of the four foot joints, `[rows, 4]`, cm/frame, from standardised v^b `[rows, 69]`.
    pub(super) fn foot_speeds<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        velocities: Var,
    ) -> Result<Var, AutogradError> {
        let vectors = self.feet.forward(tape, velocities)?;
        norms(tape, vectors, FEET.len())
    }
}

fn norms<T: Real>(tape: &mut Tape<'_, T>, x: Var, vectors: usize) -> Result<Var, AutogradError> {
    let rows = tape.shape(x)[0];
    let x = tape.reshape(x, &[rows, vectors, 3])?;
    tape.vector_norm(x, NORM_EPS)
}

fn factor_map(mean: &[f64], std: &[f64]) -> Affine {
    let mut weight = Array2::zeros((PARTS, JOINTS));
    for (part, joints) in PART_WEIGHTS.iter().enumerate() {
        let sum: f64 = joints.iter().map(|(_, w)| w).sum();
        for &(joint, w) in *joints {
            // The root's velocity stands behind the others'.
            let column = if joint == 0 { JOINTS - 1 } else { joint - 1 };
            weight[[part, column]] = w / sum / std[part];
        }
    }
    let bias = mean.iter().zip(std).map(|(m, s)| -m / s).collect();
    Affine { weight, bias }
}

/// Each bone's vector from the joints' positions, `[69, 69]`.
fn bone_map() -> Array2<f64> {
    let mut map = Array2::zeros((3 * (JOINTS - 1), 3 * (JOINTS - 1)));
    for (joint, parent) in DANCE_PARENTS.into_iter().enumerate().skip(1) {
        for axis in 0..3 {
            let row = 3 * (joint - 1) + axis;
            map[[row, row]] = 1.0;
            // The root stands at 0.
            if let Some(parent) = parent.filter(|&parent| parent > 0) {
                map[[row, 3 * (parent - 1) + axis]] = -1.0;
            }
        }
    }
    map
}

/// The foot joints' numbers, `[12, 69]`.
fn foot_map() -> Array2<f64> {
    let mut map = Array2::zeros((3 * FEET.len(), 3 * (JOINTS - 1)));
    for (k, joint) in FEET.into_iter().enumerate() {
        for axis in 0..3 {
            map[[3 * k + axis, 3 * (joint - 1) + axis]] = 1.0;
        }
    }
    map
}

/// `map` applied to restored numbers: x std + mean.
fn restored(map: &Array2<f64>, mean: &[f64], std: &[f64]) -> Affine {
    let mut weight = map.clone();
    for mut row in weight.rows_mut() {
        row.iter_mut().zip(std).for_each(|(w, s)| *w *= s);
    }
    let bias = map
        .rows()
        .into_iter()
        .map(|row| row.iter().zip(mean).map(|(w, m)| w * m).sum())
        .collect();
    Affine { weight, bias }
}

/// Lengths of the 23 bones of one frame's p^b (cm).
pub(super) fn lengths_of(positions: &[f64]) -> Vec<f64> {
    let at = |joint: usize| match joint {
        0 => DVec3::ZERO,
        _ => DVec3::from_slice(&positions[3 * (joint - 1)..]),
    };
    (1..JOINTS)
        .map(|joint| {
            let parent = DANCE_PARENTS[joint].unwrap_or(0);
            ((at(joint) - at(parent)).length_squared() + NORM_EPS).sqrt()
        })
        .collect()
}

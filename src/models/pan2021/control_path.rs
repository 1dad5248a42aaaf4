//! A feed-forward path from the controls around a frame to its p^b, beside the network; not in the paper.

use rand::Rng;

use super::config::Pan2021Config;
use super::given::Given;
use super::guess::{Estimator, estimate};
use super::units::{NORM_EPS, Units};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::Batch;
use crate::motion::features::{BODY_POSITIONS, FACING, ROOT_POSITION, VELOCITY_FACTORS};
use crate::nn::{Initialiser, LastLayer, Linear, Mlp};

/// Frames, from the one that is predicted, whose controls are seen; those before k1 and after k2 are the keyframes'.
const OFFSETS: [isize; 13] = [-20, -12, -7, -4, -2, -1, 0, 1, 2, 4, 7, 12, 20];
/// From rad a frame to numbers about 1.
const TURN_SCALE: f64 = 30.0;
/// What is dropped of the last hidden layer while single frames are trained.
const DROPOUT: f64 = 0.2;

/// Corrections of the estimate of p^b from the given trajectory, the velocity factors and the keyframes, without memory: an [`Mlp`] of
/// two hidden layers.
///
/// What it sees of frame t: the mean velocity of p^r from it to each of the [`OFFSETS`] but 0, turned to the direction that is between the
/// keyframes' o^r there, x and z, in deviations of v^r; the height of the root and, where the network has them, the five velocity factors at each,
/// standardised; the turn from k1 to k2, rad a frame times 30; the estimate, p^b of k1 and of k2, these two times their likeness to
/// frame t. All that twice, the second time multiplied with what the estimate leaves open in frame t, as the correction is itself.
#[derive(Debug, Clone)]
pub(super) struct ControlPath {
    hidden: Mlp,
    last: Linear,
    velocity_factor: bool,
}

/// Frames as the path sees them, in rows.
struct Seen {
    /// `[rows, 2 * seen]`
    input: Var,
    /// What the estimate leaves open, `[rows, 1]`.
    open: Var,
}

/// A frame of a window: the window's batch and estimator, the frame, the window.
type Place<'a, T> = (Given<'a, T>, &'a Estimator, usize, usize);

impl ControlPath {
    pub fn new<T: Real, R: Rng>(init: &mut Initialiser<'_, T, R>, config: &Pan2021Config) -> Self {
        let (seen, hidden) = (2 * seen(config.velocity_factor), config.hidden);
        let sizes = [seen, hidden, hidden];
        Self {
            hidden: Mlp::new(init, "control_path", &sizes, LastLayer::Activated),
            last: Linear::of_zeros(init, "control_path.4", hidden, BODY_POSITIONS.len()),
            velocity_factor: config.velocity_factor,
        }
    }

    /// Corrections of p^b in frames k1 + 1 .. k2, in deviations of p^b: `[N * windows, 69]`, frame by frame; without dropout.
    ///
    /// # Errors
    /// None with the weights that [`ControlPath::new`] added.
    pub fn corrections<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        estimator: &Estimator,
        given: Given<'_, T>,
    ) -> Result<Var, AutogradError> {
        let places: Vec<_> = (1..=given.transition)
            .flat_map(|t| (0..given.windows).map(move |window| (given, estimator, t, window)))
            .collect();
        let seen = self.seen(tape, units, &places);
        let hidden = self.hidden.forward(tape, seen.input)?;
        let corrections = self.last.forward(tape, hidden)?;
        tape.mul(corrections, seen.open)
    }

    /// The distance of p^b with the corrections from the true one, in s_p, the mean over the batch's single frames: `[1]`. What LRP
    /// measures.
    ///
    /// # Errors
    /// Windows of another shape than they are to have.
    pub fn loss<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        batch: &Batch<T>,
    ) -> Result<Var, AutogradError> {
        let frames = &batch.single_frames;
        let givens: Vec<Given<'_, T>> = frames
            .iter()
            .map(|frame| Given::new(&frame.window))
            .collect::<Result<_, _>>()?;
        let estimators: Vec<_> = givens
            .iter()
            .map(|given| Estimator::new(given.transition))
            .collect();
        let places: Vec<_> = frames
            .iter()
            .zip(givens.iter().zip(&estimators))
            .map(|(frame, (given, estimator))| (*given, estimator, frame.frame, 0))
            .collect();
        let numbers = BODY_POSITIONS.len();
        let missed = tape.constant_with(&[places.len(), numbers], |out| {
            for (out, &(given, estimator, t, window)) in out.chunks_exact_mut(numbers).zip(&places)
            {
                let [first, last, now] = [0, given.transition, t].map(|t| given.row(t, window));
                let weights = estimator.weights(t).map(T::from_f64);
                for (number, out) in out.iter_mut().enumerate() {
                    *out = now[number] - estimate(weights, units.ends(number, first, last));
                }
            }
        });
        let seen = self.seen(tape, units, &places);
        let hidden = self.hidden.forward(tape, seen.input)?;
        let hidden = tape.dropout(hidden, DROPOUT);
        let corrections = self.last.forward(tape, hidden)?;
        let corrections = tape.mul(corrections, seen.open)?;
        let error = tape.sub(missed, corrections)?;
        let error = units.in_scale(tape, error)?;
        let distances = tape.vector_norm(error, NORM_EPS)?;
        let sum = tape.sum(distances);
        let mean = 1.0 / batch.total_single_frames.max(1) as f64;
        Ok(tape.affine(sum, mean, 0.0))
    }

    fn seen<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        places: &[Place<'_, T>],
    ) -> Seen {
        let half = seen(self.velocity_factor);
        let open: Vec<T> = places
            .iter()
            .map(|&(_, estimator, t, _)| T::from_f64(estimator.deviation(t)))
            .collect();
        let input = tape.constant_with(&[places.len(), 2 * half], |out| {
            let mut seen = Vec::with_capacity(half);
            for ((out, &place), &open) in out.chunks_exact_mut(2 * half).zip(places).zip(&open) {
                seen.clear();
                self.see(units, place, &mut seen);
                let (plain, opened) = out.split_at_mut(half);
                plain.copy_from_slice(&seen);
                for (opened, &plain) in opened.iter_mut().zip(&seen) {
                    *opened = open * plain;
                }
            }
        });
        Seen {
            input,
            open: tape.constant_with(&[places.len(), 1], |out| out.copy_from_slice(&open)),
        }
    }

    /// Appends what is seen of a frame.
    fn see<T: Real>(
        &self,
        units: &Units,
        (given, estimator, t, window): Place<'_, T>,
        seen: &mut Vec<T>,
    ) {
        let n = given.transition;
        let [first, last, now] = [0, n, t].map(|t| given.row(t, window));
        let near = |offset: isize| given.row(t.saturating_add_signed(offset).min(n), window);
        let turn = (last[FACING.start] - first[FACING.start]) / T::from_f64(n as f64);
        let facing = units.facing(first[FACING.start] + turn * T::from_f64(t as f64));
        let (sin, cos) = facing.sin_cos();
        for offset in OFFSETS.into_iter().filter(|&offset| offset != 0) {
            let scale = 1.0 / (offset.unsigned_abs() as f64 * units.floor_speed);
            let [x, z] = [0, 2].map(|axis| {
                let column = ROOT_POSITION.start + axis;
                (near(offset)[column] - now[column])
                    * T::from_f64(scale * units.position_std[column])
            });
            seen.extend([cos * x - sin * z, cos * z + sin * x]);
        }
        for offset in OFFSETS {
            seen.push(near(offset)[ROOT_POSITION.start + 1]);
            if self.velocity_factor {
                seen.extend(&near(offset)[VELOCITY_FACTORS]);
            }
        }
        seen.push(turn * T::from_f64(units.facing_std * TURN_SCALE));
        let weights = estimator.weights(t).map(T::from_f64);
        seen.extend(
            BODY_POSITIONS.map(|number| estimate(weights, units.ends(number, first, last))),
        );
        let [to_first, to_last] = estimator.likenesses(t).map(T::from_f64);
        seen.extend(first[BODY_POSITIONS].iter().map(|&x| to_first * x));
        seen.extend(last[BODY_POSITIONS].iter().map(|&x| to_last * x));
    }
}

/// Numbers that are seen of one frame.
fn seen(velocity_factor: bool) -> usize {
    let factors = match velocity_factor {
        true => VELOCITY_FACTORS.len(),
        false => 0,
    };
    2 * (OFFSETS.len() - 1) + OFFSETS.len() * (1 + factors) + 1 + 3 * BODY_POSITIONS.len()
}

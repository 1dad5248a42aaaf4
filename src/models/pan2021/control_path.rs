//! A feed-forward path from the controls around a frame to its p^b, beside the network; not in the paper.

use rand::Rng;

use super::config::Pan2021Config;
use super::guess::Estimator;
use super::units::Units;
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::motion::features::{
    BODY_POSITIONS, BODY_VELOCITIES, FACING, FEATURES, ROOT_POSITION, VELOCITY_FACTORS,
};
use crate::nn::{Initialiser, LastLayer, Mlp};

/// Frames, from the one that is predicted, whose controls are seen; those before k1 and after k2 are the keyframes'.
const OFFSETS: [isize; 13] = [-20, -12, -7, -4, -2, -1, 0, 1, 2, 4, 7, 12, 20];
/// From rad a frame to numbers about 1.
const TURN_SCALE: f64 = 30.0;

/// Corrections of the estimate of p^b from the given trajectory, the velocity factors and the keyframes, without memory: an [`Mlp`].
///
/// What it sees of frame t: the mean velocity of p^r from it to each of the [`OFFSETS`] but 0, seen in the direction between the keyframes' o^r,
/// x and z, in deviations of v^r; the height of the root and, where the network has them, the five velocity factors at each,
/// standardised; the turn from k1 to k2, rad a frame times 30; the estimate, p^b of k1 and of k2, these two times their likeness to
/// frame t. All that twice, the second time multiplied with what the estimate leaves open in frame t, as the correction is itself.
#[derive(Debug, Clone)]
pub(super) struct ControlPath {
    layers: Mlp,
    velocity_factor: bool,
}

/// A batch as the network is given it: standardised `[frames, windows, 154]`.
#[derive(Clone, Copy)]
pub(super) struct Given<'f, T> {
    pub values: &'f [T],
    pub windows: usize,
}

impl<'f, T> Given<'f, T> {
    pub fn frame(&self, frame: usize, window: usize) -> &'f [T] {
        &self.values[(frame * self.windows + window) * FEATURES..][..FEATURES]
    }
}

impl ControlPath {
    pub fn new<T: Real, R: Rng>(init: &mut Initialiser<'_, T, R>, config: &Pan2021Config) -> Self {
        let sizes = [
            2 * seen(config.velocity_factor),
            config.hidden,
            BODY_POSITIONS.len(),
        ];
        Self {
            layers: Mlp::new(init, "control_path", &sizes, LastLayer::Zero),
            velocity_factor: config.velocity_factor,
        }
    }

    /// Corrections of p^b in frames k1 + 1 .. k2, N = `transition`, in deviations of p^b: `[N * windows, 69]`, frame by frame.
    ///
    /// # Errors
    /// None on a batch of the right shape.
    pub fn corrections<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        estimator: &Estimator,
        given: Given<'_, T>,
        transition: usize,
    ) -> Result<Var, AutogradError> {
        let width = 2 * seen(self.velocity_factor);
        let rows = transition * given.windows;
        let input = tape.constant_with(&[rows, width], |out| {
            for (row, out) in out.chunks_exact_mut(width).enumerate() {
                let (t, window) = (1 + row / given.windows, row % given.windows);
                let (plain, opened) = out.split_at_mut(width / 2);
                self.see(units, estimator, given, (transition, t, window), plain);
                let open = T::from_f64(estimator.deviation(t));
                for (opened, &plain) in opened.iter_mut().zip(&*plain) {
                    *opened = open * plain;
                }
            }
        });
        let corrections = self.layers.forward(tape, input)?;
        let open = tape.constant_with(&[rows, 1], |out| {
            for (t, out) in (1..).zip(out.chunks_exact_mut(given.windows.max(1))) {
                out.fill(T::from_f64(estimator.deviation(t)));
            }
        });
        tape.mul(corrections, open)
    }

    /// What is seen of frame `t` of a window.
    fn see<T: Real>(
        &self,
        units: &Units,
        estimator: &Estimator,
        given: Given<'_, T>,
        (transition, t, window): (usize, usize, usize),
        out: &mut [T],
    ) {
        let frame = |index: usize| given.frame(index, window);
        let (first, last, now) = (frame(0), frame(transition), frame(t));
        let near = |offset: isize| frame(t.saturating_add_signed(offset).min(transition));
        let turn = (last[FACING.start] - first[FACING.start]) / T::from_f64(transition as f64);
        let facing = units.facing(first[FACING.start] + turn * T::from_f64(t as f64));
        let (sin, cos) = facing.sin_cos();
        let mut out = out.iter_mut();
        let mut put = |number: T| {
            if let Some(out) = out.next() {
                *out = number;
            }
        };
        for offset in OFFSETS.into_iter().filter(|&offset| offset != 0) {
            let scale = 1.0 / (offset.unsigned_abs() as f64 * units.floor_speed);
            let [x, z] = [0, 2].map(|axis| {
                let column = ROOT_POSITION.start + axis;
                (near(offset)[column] - now[column])
                    * T::from_f64(scale * units.position_std[column])
            });
            put(cos * x - sin * z);
            put(cos * z + sin * x);
        }
        for offset in OFFSETS {
            put(near(offset)[ROOT_POSITION.start + 1]);
            if self.velocity_factor {
                near(offset)[VELOCITY_FACTORS]
                    .iter()
                    .copied()
                    .for_each(&mut put);
            }
        }
        put(turn * T::from_f64(units.facing_std * TURN_SCALE));
        let weights = estimator.weights(t).map(T::from_f64);
        for column in BODY_POSITIONS {
            let speed = units.speed(column, first[BODY_VELOCITIES.start + column]);
            put(weights[0] * first[column] + weights[1] * speed + weights[2] * last[column]);
        }
        let [to_first, to_last] = estimator.likenesses(t).map(T::from_f64);
        first[BODY_POSITIONS]
            .iter()
            .for_each(|&x| put(to_first * x));
        last[BODY_POSITIONS].iter().for_each(|&x| put(to_last * x));
    }
}

/// Numbers that are seen of one frame.
fn seen(velocity_factor: bool) -> usize {
    let factors = if velocity_factor {
        VELOCITY_FACTORS.len()
    } else {
        0
    };
    2 * (OFFSETS.len() - 1) + OFFSETS.len() * (1 + factors) + 1 + 3 * BODY_POSITIONS.len()
}

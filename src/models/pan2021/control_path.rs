//! A feed-forward path from the controls around a frame to its p^b, beside the network; not in the
//! paper.

use rand::Rng;

use super::config::Pan2021Config;
use super::given::Given;
use super::guess::{Estimator, estimate};
use super::units::{NORM_EPS, Units};
use crate::autograd::{AutogradError, Real, Tape, Var};
use crate::models::transition::Batch;
use crate::motion::features::{BODY_POSITIONS, FACING, ROOT_POSITION, VELOCITY_FACTORS};
use crate::nn::{Initialiser, LastLayer, Linear, Mlp};

/// Frames, from the one that is predicted, whose controls are seen; those before k1 and after k2
/// are the keyframes'.
const OFFSETS: [isize; 13] = [-20, -12, -7, -4, -2, -1, 0, 1, 2, 4, 7, 12, 20];
/// From rad a frame to numbers about 1.
const TURN_SCALE: f64 = 30.0;
/// What is dropped of the last hidden layer while single frames are trained.
const DROPOUT: f64 = 0.2;

/// Corrections of the estimate of p^b from the given trajectory, the velocity factors and the
/// keyframes, without memory: an [`Mlp`] of two hidden layers.
///
/// What it sees of frame t: the mean velocity of p^r from it to each of the [`OFFSETS`] but 0,
/// turned to the direction that is between the keyframes' o^r there, x and z, in deviations of v^r;
/// the height of the root and, where the network has them, the five velocity factors at each,
/// standardised; the turn from k1 to k2, rad a frame times 30; the estimate, p^b of k1 and of k2,
/// these two times their likeness to frame t. All that twice, the second time multiplied with what
/// the estimate leaves open in frame t, as the correction is itself.
///
/// With more than one member it is an ensemble: the correction is the mean of its members', which
/// differ in their initial weights and in what dropout takes from them.
#[derive(Debug, Clone)]
pub(super) struct ControlPath {
    first: Member,
    others: Vec<Member>,
    velocity_factor: bool,
}

#[derive(Debug, Clone)]
struct Member {
    hidden: Mlp,
    last: Linear,
}

impl Member {
    fn new<T: Real, R: Rng>(
        init: &mut Initialiser<'_, T, R>,
        name: &str,
        seen: usize,
        hidden: usize,
    ) -> Self {
        let (sizes, last) = ([seen, hidden, hidden], format!("{name}.4"));
        Self {
            hidden: Mlp::new(init, name, &sizes, LastLayer::Activated),
            last: Linear::of_zeros(init, &last, hidden, BODY_POSITIONS.len()),
        }
    }
}

/// Frames as the path sees them, in rows.
struct Seen {
    /// `[rows, 2 * seen]`
    input: Var,
    /// What the estimate leaves open, `[rows, 1]`.
    open: Var,
}

/// Frame k1 + `t` of a window of a batch.
#[derive(Clone, Copy)]
struct Place<'f, T> {
    given: Given<'f, T>,
    estimator: Estimator,
    t: usize,
    window: usize,
}

impl<'f, T: Real> Place<'f, T> {
    /// Frame k1 + `t` of the same window, 154 numbers.
    fn row(&self, t: usize) -> &'f [T] {
        self.given.row(t, self.window)
    }

    /// Keyframes k1 and k2.
    fn keyframes(&self) -> [&'f [T]; 2] {
        [0, self.given.transition].map(|t| self.row(t))
    }

    /// The estimate of p^b.
    fn estimate(&self, units: &Units) -> [T; BODY_POSITIONS.end] {
        let [first, last] = self.keyframes();
        let weights = self.estimator.weights(self.t).map(T::from_f64);
        std::array::from_fn(|number| estimate(weights, units.ends(number, first, last)))
    }
}

impl ControlPath {
    pub fn new<T: Real, R: Rng>(init: &mut Initialiser<'_, T, R>, config: &Pan2021Config) -> Self {
        let (seen, hidden) = (2 * seen(config.velocity_factor), config.control_path_hidden);
        let first = Member::new(init, "control_path", seen, hidden);
        let others = (2..=config.control_path_members)
            .map(|member| Member::new(init, &format!("control_path_{member}"), seen, hidden));
        Self {
            first,
            others: others.collect(),
            velocity_factor: config.velocity_factor,
        }
    }

    /// Corrections of p^b in frames k1 + 1 .. k2, in deviations of p^b: `[N * windows, 69]`, frame
    /// by frame; without dropout.
    ///
    /// # Errors
    /// None with the weights that [`ControlPath::new`] added.
    pub fn corrections<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        estimator: Estimator,
        given: Given<'_, T>,
    ) -> Result<Var, AutogradError> {
        let places: Vec<_> = (1..=given.transition)
            .flat_map(|t| {
                (0..given.windows).map(move |window| Place {
                    given,
                    estimator,
                    t,
                    window,
                })
            })
            .collect();
        let seen = self.seen(tape, units, &places);
        let corrections = self.mean_of_members(tape, |tape, member| {
            let hidden = member.hidden.forward(tape, seen.input)?;
            member.last.forward(tape, hidden)
        })?;
        tape.mul(corrections, seen.open)
    }

    /// The distance of p^b with a member's corrections from the true one, in s_p, the mean over the
    /// batch's single frames and the members: `[1]`. What LRP measures, of each member by itself:
    /// trained on the distance of their mean they would become parts of one network.
    ///
    /// # Errors
    /// Windows of another shape than they are to have, or a frame beyond its window.
    pub fn loss<T: Real>(
        &self,
        tape: &mut Tape<'_, T>,
        units: &Units,
        batch: &Batch<T>,
    ) -> Result<Var, AutogradError> {
        let places = batch
            .single_frames
            .iter()
            .map(|frame| {
                let given = Given::new(&frame.window)?;
                if !(1..=given.transition).contains(&frame.frame) {
                    return Err(AutogradError::Argument {
                        operation: "pan2021",
                        shape: frame.window.shape().to_vec(),
                        argument: format!("frame {} of a window", frame.frame),
                        expected: "1 to N",
                    });
                }
                Ok(Place {
                    given,
                    estimator: Estimator::new(given.transition),
                    t: frame.frame,
                    window: 0,
                })
            })
            .collect::<Result<Vec<_>, AutogradError>>()?;
        let numbers = BODY_POSITIONS.len();
        let missed = tape.constant_with(&[places.len(), numbers], |out| {
            for (out, place) in out.chunks_exact_mut(numbers).zip(&places) {
                let truth = &place.row(place.t)[BODY_POSITIONS];
                for ((out, &truth), estimate) in
                    out.iter_mut().zip(truth).zip(place.estimate(units))
                {
                    *out = truth - estimate;
                }
            }
        });
        let seen = self.seen(tape, units, &places);
        let sum = self.mean_of_members(tape, |tape, member| {
            let hidden = member.hidden.forward(tape, seen.input)?;
            let hidden = tape.dropout(hidden, DROPOUT);
            let corrections = member.last.forward(tape, hidden)?;
            let corrections = tape.mul(corrections, seen.open)?;
            let error = tape.sub(missed, corrections)?;
            let error = units.in_scale(tape, error)?;
            let distances = tape.vector_norm(error, NORM_EPS)?;
            Ok(tape.sum(distances))
        })?;
        let mean = 1.0 / batch.total_single_frames.max(1) as f64;
        Ok(tape.affine(sum, mean, 0.0))
    }

    fn mean_of_members<'p, T: Real>(
        &self,
        tape: &mut Tape<'p, T>,
        of: impl Fn(&mut Tape<'p, T>, &Member) -> Result<Var, AutogradError>,
    ) -> Result<Var, AutogradError> {
        let mut sum = of(tape, &self.first)?;
        for member in &self.others {
            let next = of(tape, member)?;
            sum = tape.add(sum, next)?;
        }
        Ok(tape.affine(sum, 1.0 / (1 + self.others.len()) as f64, 0.0))
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
            .map(|place| T::from_f64(place.estimator.deviation(place.t)))
            .collect();
        let input = tape.constant_with(&[places.len(), 2 * half], |out| {
            let mut seen = Vec::with_capacity(half);
            for ((out, place), &open) in out.chunks_exact_mut(2 * half).zip(places).zip(&open) {
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
    fn see<T: Real>(&self, units: &Units, place: &Place<'_, T>, seen: &mut Vec<T>) {
        let (t, n) = (place.t, place.given.transition);
        let ([first, last], now) = (place.keyframes(), place.row(t));
        let near = |offset: isize| place.row(t.saturating_add_signed(offset).min(n));
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
        seen.extend(place.estimate(units));
        let [to_first, to_last] = place.estimator.likenesses(t).map(T::from_f64);
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

//! A feed-forward path from the controls around a frame to its p^b, beside the network; not in the
//! paper.

use rand::Rng;

use super::config::Pan2021Config;
use super::given::GivenFrames;
use super::prior::{self, Prior};
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

/// Corrections of the prior mean of p^b from the given trajectory, the velocity factors and the
/// keyframes, without memory: an [`Mlp`] of two hidden layers.
///
/// What it sees of frame t: the mean velocity of p^r from it to each of the [`OFFSETS`] but 0,
/// turned to the direction that is between the keyframes' o^r there, x and z, in deviations of v^r;
/// the height of the root and, where the network has them, the five velocity factors at each,
/// standardised; the turn from k1 to k2, rad a frame times 30; the mean, p^b of k1 and of k2, these
/// two times their correlation with frame t. All that twice, the second time multiplied with the
/// residual deviation of frame t, as the correction is itself.
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
    /// The residual deviation, `[rows, 1]`.
    residual_deviation: Var,
}

/// Frame k1 + `t` of a window of a batch.
#[derive(Clone, Copy)]
struct SeenFrame<'f, T> {
    given: GivenFrames<'f, T>,
    prior: Prior,
    t: usize,
    window: usize,
}

impl<'f, T: Real> SeenFrame<'f, T> {
    /// Frame k1 + `t` of the same window, 154 numbers.
    fn row(&self, t: usize) -> &'f [T] {
        self.given.row(t, self.window)
    }

    /// Keyframes k1 and k2.
    fn keyframes(&self) -> [&'f [T]; 2] {
        [0, self.given.transition].map(|t| self.row(t))
    }

    /// The prior mean of p^b.
    fn prior_mean(&self, units: &Units) -> [T; BODY_POSITIONS.end] {
        let [first, last] = self.keyframes();
        let weights = self.prior.weights(self.t).map(T::from_f64);
        std::array::from_fn(|number| prior::mean(weights, units.ends(number, first, last)))
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
        prior: Prior,
        given: GivenFrames<'_, T>,
    ) -> Result<Var, AutogradError> {
        let frames: Vec<_> = (1..=given.transition)
            .flat_map(|t| {
                (0..given.windows).map(move |window| SeenFrame {
                    given,
                    prior,
                    t,
                    window,
                })
            })
            .collect();
        let seen = self.seen(tape, units, &frames);
        let corrections = self.mean_of_members(tape, |tape, member| {
            let hidden = member.hidden.forward(tape, seen.input)?;
            member.last.forward(tape, hidden)
        })?;
        tape.mul(corrections, seen.residual_deviation)
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
        let frames = batch
            .single_frames
            .iter()
            .map(|frame| {
                let given = GivenFrames::new(&frame.window)?;
                if !(1..=given.transition).contains(&frame.frame) {
                    return Err(AutogradError::Argument {
                        operation: "pan2021",
                        shape: frame.window.shape().to_vec(),
                        argument: format!("frame {} of a window", frame.frame),
                        expected: "1 to N",
                    });
                }
                Ok(SeenFrame {
                    given,
                    prior: Prior::new(given.transition),
                    t: frame.frame,
                    window: 0,
                })
            })
            .collect::<Result<Vec<_>, AutogradError>>()?;
        let numbers = BODY_POSITIONS.len();
        let missed = tape.constant_with(&[frames.len(), numbers], |out| {
            for (out, frame) in out.chunks_exact_mut(numbers).zip(&frames) {
                let truth = &frame.row(frame.t)[BODY_POSITIONS];
                for ((out, &truth), mean) in out.iter_mut().zip(truth).zip(frame.prior_mean(units))
                {
                    *out = truth - mean;
                }
            }
        });
        let seen = self.seen(tape, units, &frames);
        let sum = self.mean_of_members(tape, |tape, member| {
            let hidden = member.hidden.forward(tape, seen.input)?;
            let hidden = tape.dropout(hidden, DROPOUT);
            let corrections = member.last.forward(tape, hidden)?;
            let corrections = tape.mul(corrections, seen.residual_deviation)?;
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
        frames: &[SeenFrame<'_, T>],
    ) -> Seen {
        let half = seen(self.velocity_factor);
        let deviations: Vec<T> = frames
            .iter()
            .map(|frame| T::from_f64(frame.prior.deviation(frame.t)))
            .collect();
        let input = tape.constant_with(&[frames.len(), 2 * half], |out| {
            let mut seen = Vec::with_capacity(half);
            for ((out, frame), &deviation) in
                out.chunks_exact_mut(2 * half).zip(frames).zip(&deviations)
            {
                seen.clear();
                self.see(units, frame, &mut seen);
                let (plain, scaled) = out.split_at_mut(half);
                plain.copy_from_slice(&seen);
                for (scaled, &plain) in scaled.iter_mut().zip(&seen) {
                    *scaled = deviation * plain;
                }
            }
        });
        Seen {
            input,
            residual_deviation: tape
                .constant_with(&[frames.len(), 1], |out| out.copy_from_slice(&deviations)),
        }
    }

    /// Appends what is seen of a frame.
    fn see<T: Real>(&self, units: &Units, frame: &SeenFrame<'_, T>, seen: &mut Vec<T>) {
        let (t, n) = (frame.t, frame.given.transition);
        let ([first, last], now) = (frame.keyframes(), frame.row(t));
        let near = |offset: isize| frame.row(t.saturating_add_signed(offset).min(n));
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
        seen.extend(frame.prior_mean(units));
        let [to_first, to_last] = frame.prior.correlations(t).map(T::from_f64);
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

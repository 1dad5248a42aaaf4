//! Predicted bodies brought to the velocity factors that were asked for, after the last frame is
//! predicted; not in the paper.
//!
//! A network that is trained on distances gives about the mean of the motions that fit, which is
//! slower than each of them, and trembles where frames are corrected one by one. What is wanted is
//! near it, smooth, and as fast as asked for: with p_t the predicted p^b, x_t the refined one, x_0
//! keyframe k1 and x_N = p_N,
//!
//! ```text
//! sum_t ||x_t - p_t||^2 + 100 ||x_(t+1) - 2 x_t + x_(t-1)||^2 + 300 ||x_t - x_(t-1) - w_t||^2
//! ```
//!
//! where w_t are the velocities that a motion has, each joint's times the ratio of the velocity
//! factor (eq. 1) asked for to the one its part of the body has in that frame. Ten times, beginning
//! with p itself, w is taken from the last x, x is the minimum (a linear system with two diagonals
//! beside the main one, the same for all 69 numbers), and then each bone, from the root outwards,
//! keeps its direction and gets the mean of two lengths: that in p_t and the dancer's, which goes
//! evenly from k1's to p_N's. The lengths in p are smoothed over time beforehand, by the first two
//! terms. (Constraints met by turns: projective dynamics, Bouaziz et al., ACM TOG 33(4), 2014.)
//!
//! A mean of motions has short bones where these differ, and so is nearer to each of them than a
//! body with the dancer's own; but joints that are as fast as asked on short bones are too fast
//! once rotations put them on the skeleton's. Halfway had the best LRP on validation clips.

mod bones;
mod system;

use ndarray::{ArrayView1, ArrayViewMut2};

use super::TransitionRequest;
use crate::motion::features::{BODY_POSITIONS, BODY_VELOCITIES, ROOT_POSITION};
use crate::motion::velocity_factor::{PART_WEIGHTS, PARTS, velocity_factors};
use bones::{lengths_wanted, with_lengths};
use system::System;

const ACCELERATION_WEIGHT: f64 = 100.0;
const VELOCITY_WEIGHT: f64 = 300.0;
const ROUNDS: usize = 10;
/// What a velocity is multiplied with at most in one round: a part that hardly moves has no
/// direction to go on in.
const MOST: f64 = 3.0;

/// Numbers of p^b.
const NUMBERS: usize = BODY_POSITIONS.end;

/// p^b of a frame, cm.
type Body = [f64; NUMBERS];

/// Changes p^b in frames k1 + 1 .. k2 - 1 as the module says, and sets v^b of all frames to the
/// steps of p^b.
///
/// `frames`: k1 + 1 .. k2, `[N, 149]`, not standardised (cm, cm/frame), N that of the request,
/// which has passed its check.
pub fn refine(request: &TransitionRequest, mut frames: ArrayViewMut2<f64>) {
    let body = |row: ArrayView1<f64>| -> Body { std::array::from_fn(|i| row[i]) };
    let mut predicted = vec![body(request.start.features.view())];
    predicted.extend(frames.rows().into_iter().map(body));
    let steps = Steps::new(request, &frames);
    let system = System::new(frames.nrows(), VELOCITY_WEIGHT, ACCELERATION_WEIGHT);
    let rough = rough(&predicted);
    let lengths = lengths_wanted(&predicted);
    let mut refined = predicted.clone();
    for _ in 0..ROUNDS {
        // What is solved for is the change of p, which is 0 in both keyframes.
        let mut pull = steps.velocities_wanted(&refined);
        for (pull, pair) in pull.iter_mut().zip(predicted.windows(2)) {
            for (i, pull) in pull.iter_mut().enumerate() {
                *pull -= pair[1][i] - pair[0][i];
            }
        }
        let mut change: Vec<Body> = (1..frames.nrows())
            .map(|t| {
                std::array::from_fn(|i| {
                    VELOCITY_WEIGHT * (pull[t - 1][i] - pull[t][i])
                        - ACCELERATION_WEIGHT * rough[t][i]
                })
            })
            .collect();
        system.solve(&mut change);
        for (t, change) in (1..).zip(&change) {
            let solved = std::array::from_fn(|i| predicted[t][i] + change[i]);
            refined[t] = with_lengths(&solved, &lengths[t]);
        }
    }
    for (mut frame, pair) in frames.rows_mut().into_iter().zip(refined.windows(2)) {
        for i in 0..NUMBERS {
            frame[BODY_POSITIONS.start + i] = pair[1][i];
            frame[BODY_VELOCITIES.start + i] = pair[1][i] - pair[0][i];
        }
    }
}

/// The gradient of half the sum of squared second differences, for every frame.
fn rough<const NUMBERS: usize>(values: &[[f64; NUMBERS]]) -> Vec<[f64; NUMBERS]> {
    let mut rough = vec![[0.0; NUMBERS]; values.len()];
    for t in 1..values.len().saturating_sub(1) {
        for i in 0..NUMBERS {
            let bend = values[t - 1][i] - 2.0 * values[t][i] + values[t + 1][i];
            rough[t - 1][i] += bend;
            rough[t][i] -= 2.0 * bend;
            rough[t + 1][i] += bend;
        }
    }
    rough
}

/// What is asked of every step from one frame to the next.
struct Steps {
    /// Velocity factors without the root's share, cm/frame.
    wanted: Vec<[f64; PARTS]>,
    /// Each joint's part.
    parts: [usize; NUMBERS / 3],
}

impl Steps {
    fn new(request: &TransitionRequest, frames: &ArrayViewMut2<f64>) -> Self {
        let mut before: [f64; 3] = std::array::from_fn(|axis| request.root_trajectory[[0, axis]]);
        let wanted = frames
            .rows()
            .into_iter()
            .zip(request.velocity_factors.rows().into_iter().skip(1))
            .map(|(frame, asked)| {
                let mut velocities = [0.0; NUMBERS + 3];
                for axis in 0..3 {
                    let place = frame[ROOT_POSITION.start + axis];
                    velocities[NUMBERS + axis] = place - before[axis];
                    before[axis] = place;
                }
                let of_root = velocity_factors(&velocities);
                std::array::from_fn(|part| (asked[part] - of_root[part]).max(0.0))
            })
            .collect();
        let mut parts = [0; NUMBERS / 3];
        for (part, joints) in PART_WEIGHTS.iter().enumerate() {
            for &(joint, _) in joints.iter().filter(|(joint, _)| *joint > 0) {
                parts[joint - 1] = part;
            }
        }
        Self { wanted, parts }
    }

    /// w of every step of a motion.
    fn velocities_wanted(&self, bodies: &[Body]) -> Vec<Body> {
        bodies
            .windows(2)
            .zip(&self.wanted)
            .map(|(pair, wanted)| {
                let mut velocities = [0.0; NUMBERS + 3];
                for i in 0..NUMBERS {
                    velocities[i] = pair[1][i] - pair[0][i];
                }
                let has = velocity_factors(&velocities);
                let times: [f64; PARTS] = std::array::from_fn(|part| {
                    // 0 / 0 is 0 here: there is nothing to multiply.
                    (wanted[part] / has[part].max(f64::MIN_POSITIVE)).min(MOST)
                });
                std::array::from_fn(|i| velocities[i] * times[self.parts[i / 3]])
            })
            .collect()
    }
}

//! Predicted bodies brought to the velocity factors that were asked for, after the last frame is predicted; not in the paper.
//!
//! A network that is trained on distances gives about the mean of the motions that fit, which is slower than each of them, and trembles where
//! frames are corrected one by one. What is wanted is near it, smooth, and as fast as asked for: with p_t the predicted p^b, x_t
//! the refined one, x_0 keyframe k1 and x_N = p_N,
//!
//! ```text
//! sum_t ||x_t - p_t||^2 + 100 ||x_(t+1) - 2 x_t + x_(t-1)||^2 + 300 ||x_t - x_(t-1) - w_t||^2
//! ```
//!
//! where w_t are the velocities that a motion has, each joint's times the ratio of the velocity factor (eq. 1) asked for to the one its part of
//! the body has in that frame. Ten times, beginning with p itself, w is taken from the last x and x is the minimum: a linear system with two
//! diagonals beside the main one, the same for all 69 numbers. (This is how projective dynamics meets its constraints, Bouaziz et al., ACM TOG
//! 33(4), 2014.) Bone lengths are not held, and short ones can become much longer.

use ndarray::{ArrayView1, ArrayViewMut2};

use super::TransitionRequest;
use crate::motion::features::{BODY_POSITIONS, BODY_VELOCITIES, ROOT_POSITION};
use crate::motion::velocity_factor::{PART_WEIGHTS, PARTS, velocity_factors};

const ACCELERATION_WEIGHT: f64 = 100.0;
const VELOCITY_WEIGHT: f64 = 300.0;
const ROUNDS: usize = 10;
/// What a velocity is multiplied with at most in one round: a part that hardly moves has no direction to go on in.
const MOST: f64 = 3.0;

/// Numbers of p^b.
const NUMBERS: usize = BODY_POSITIONS.end;

type Body = [f64; NUMBERS];

/// Changes p^b in frames k1 + 1 .. k2 - 1 as the module says, and sets v^b of all frames to the steps of p^b.
///
/// `frames`: k1 + 1 .. k2, `[N, 149]`, not standardised (cm, cm/frame), N that of the request, which has passed its check.
pub fn refine(request: &TransitionRequest, mut frames: ArrayViewMut2<f64>) {
    let body = |row: ArrayView1<f64>| -> Body { std::array::from_fn(|i| row[i]) };
    let mut predicted = vec![body(request.start.features.view())];
    predicted.extend(frames.rows().into_iter().map(body));
    let steps = Steps::new(request, &frames);
    let system = System::new(frames.nrows());
    let rough = rough(&predicted);
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
        for ((refined, predicted), change) in
            refined[1..].iter_mut().zip(&predicted[1..]).zip(&change)
        {
            *refined = std::array::from_fn(|i| predicted[i] + change[i]);
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
fn rough(bodies: &[Body]) -> Vec<Body> {
    let mut rough = vec![[0.0; NUMBERS]; bodies.len()];
    for t in 1..bodies.len().saturating_sub(1) {
        for i in 0..NUMBERS {
            let bend = bodies[t - 1][i] - 2.0 * bodies[t][i] + bodies[t + 1][i];
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

/// The matrix of the linear system in frames k1 + 1 .. k2 - 1 as L D L^T, L with ones in its main diagonal and two diagonals below.
struct System {
    diagonal: Vec<f64>,
    /// L in row t + 1 and t + 2 of column t.
    below: Vec<[f64; 2]>,
}

impl System {
    fn new(length: usize) -> Self {
        let mut matrix = vec![[0.0; 3]; length + 1]; // columns t, t + 1, t + 2 of row t
        for row in &mut matrix {
            row[0] = 1.0;
        }
        for t in 0..length {
            matrix[t][0] += VELOCITY_WEIGHT;
            matrix[t + 1][0] += VELOCITY_WEIGHT;
            matrix[t][1] -= VELOCITY_WEIGHT;
        }
        for t in 1..length {
            matrix[t - 1][0] += ACCELERATION_WEIGHT;
            matrix[t - 1][1] -= 2.0 * ACCELERATION_WEIGHT;
            matrix[t - 1][2] += ACCELERATION_WEIGHT;
            matrix[t][0] += 4.0 * ACCELERATION_WEIGHT;
            matrix[t][1] -= 2.0 * ACCELERATION_WEIGHT;
            matrix[t + 1][0] += ACCELERATION_WEIGHT;
        }
        let rows = matrix[1..length].to_vec();
        let mut diagonal: Vec<f64> = Vec::with_capacity(rows.len());
        let mut below: Vec<[f64; 2]> = Vec::with_capacity(rows.len());
        for (t, row) in rows.iter().enumerate() {
            let mut pivot = row[0];
            let mut next = row[1];
            if t >= 1 {
                pivot -= below[t - 1][0].powi(2) * diagonal[t - 1];
                next -= below[t - 1][0] * below[t - 1][1] * diagonal[t - 1];
            }
            if t >= 2 {
                pivot -= below[t - 2][1].powi(2) * diagonal[t - 2];
            }
            diagonal.push(pivot);
            below.push([next / pivot, row[2] / pivot]);
        }
        Self { diagonal, below }
    }

    /// Puts the solution in the place of the right side.
    fn solve(&self, right: &mut [Body]) {
        for t in 0..right.len() {
            for back in 1..=2.min(t) {
                let factor = self.below[t - back][back - 1];
                let known = right[t - back];
                for (x, known) in right[t].iter_mut().zip(known) {
                    *x -= factor * known;
                }
            }
        }
        for t in (0..right.len()).rev() {
            right[t].iter_mut().for_each(|x| *x /= self.diagonal[t]);
            for ahead in 1..=2.min(right.len() - 1 - t) {
                let factor = self.below[t][ahead - 1];
                let known = right[t + ahead];
                for (x, known) in right[t].iter_mut().zip(known) {
                    *x -= factor * known;
                }
            }
        }
    }
}

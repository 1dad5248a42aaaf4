//! What a residual network's numbers are added to: the best linear estimate of a frame from the keyframes.

use glam::{DMat3, DVec3};

/// Frames over which a number of a pose loses its likeness to itself, see [`likeness`].
const TIME: f64 = 8.0;
/// What of the likeness stays at any distance: a dancer's own mean is not that of all.
const KEPT: f64 = 0.2;
/// Keeps the covariances regular where N is small; of the variance.
const NUGGET: f64 = 1e-6;

/// Correlation of a number of p^b with itself `frames` later: `KEPT + (1 - KEPT) (1 + d) exp(-d)`, d = frames / TIME (Matern 3/2).
///
/// On training clips of the dance data (30 frames a second) that are set aside, an estimate with it is within an LRP of 12.3, 60.2, 73.2 and
/// 76.5 cm at N = 10, 50, 100 and 150, lines between the keyframes within 16.7, 64.4, 81.0 and 86.3 (`scripts/study_poses.py`).
fn likeness(frames: usize) -> f64 {
    let d = frames as f64 / TIME;
    KEPT + (1.0 - KEPT) * (1.0 + d) * (-d).exp()
}

/// The estimate of frame k1 + t, and what it leaves open.
///
/// It is linear in p^b and v^b of k1 and p^b of k2, as differences from their means, with the least expected square error (kriging) where
/// all numbers correlate as [`likeness`] says and a velocity is the difference to the frame before: near the keyframes the motion goes
/// on smoothly, far from both it is the mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    /// Of p^b of k1, v^b of k1 (in deviations of p^b a frame) and p^b of k2.
    pub weights: [f64; 3],
    /// Standard deviation of the error of p^b, in deviations of p^b: 0 in the keyframes, near 1 far from them.
    pub deviation: f64,
    /// That of the step from frame t - 1, as a share of the deviation of all steps; 0 for t = 0.
    pub step_deviation: f64,
}

impl Estimate {
    /// `t` at most N = `transition`.
    pub fn new(t: usize, transition: usize) -> Self {
        let given = Given::new(transition);
        let likely = given.likeness(t);
        let weights = given.inverse * likely;
        let step = if t == 0 {
            DVec3::ZERO
        } else {
            likely - given.likeness(t - 1)
        };
        let left = |all: f64, likely: DVec3| {
            let known = likely.dot(given.inverse * likely);
            (1.0 - known / all).max(0.0).sqrt()
        };
        let all_steps = 2.0 * (1.0 - likeness(1));
        Self {
            weights: weights.to_array(),
            deviation: left(1.0, likely),
            step_deviation: if t == 0 { 0.0 } else { left(all_steps, step) },
        }
    }
}

/// p^b and v^b of k1 and p^b of k2.
struct Given {
    transition: usize,
    /// Of their covariances.
    inverse: DMat3,
}

impl Given {
    fn new(transition: usize) -> Self {
        let last = likeness(transition);
        let covariances = [
            [1.0 + NUGGET, step(0), last],
            [step(0), (2.0 + NUGGET) * step(0), step(transition)],
            [last, step(transition), 1.0 + NUGGET],
        ];
        Self {
            transition,
            inverse: DMat3::from_cols_array_2d(&covariances).inverse(),
        }
    }

    /// Covariances with p^b of frame t.
    fn likeness(&self, t: usize) -> DVec3 {
        DVec3::new(likeness(t), step(t), likeness(self.transition - t))
    }
}

/// Covariance of p^b with v^b `frames` earlier.
fn step(frames: usize) -> f64 {
    likeness(frames) - likeness(frames + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keyframe_is_estimated_by_itself() {
        for n in [1, 2, 10, 150, 1000] {
            for (t, expected) in [(0, [1.0, 0.0, 0.0]), (n, [0.0, 0.0, 1.0])] {
                for (weight, expected) in Estimate::new(t, n).weights.into_iter().zip(expected) {
                    assert!(
                        (weight - expected).abs() < 1e-2,
                        "N = {n}, t = {t}: {weight}"
                    );
                }
            }
        }
    }

    #[test]
    fn far_from_both_keyframes_little_is_left_of_them() {
        let [first, velocity, last] = Estimate::new(500, 1000).weights;
        // KEPT from two poses that share it; of the first one two frames are known, and count together.
        for weight in [first, last, -2.0 * velocity] {
            assert!((weight - KEPT / (1.0 + KEPT)).abs() < 2e-3, "{weight}");
        }
    }

    #[test]
    fn what_is_open_is_nothing_in_the_keyframes_and_nearly_all_far_from_them() {
        for n in [1, 2, 10, 150] {
            for t in [0, n] {
                let open = Estimate::new(t, n).deviation;
                assert!(open < 2e-3, "N = {n}, t = {t}: {open}");
            }
            let open: Vec<f64> = (0..=n).map(|t| Estimate::new(t, n).deviation).collect();
            assert!(
                open.iter().all(|open| (0.0..1.0).contains(open)),
                "{open:?}"
            );
            // Rises to one frame between the keyframes and falls after it.
            let turns = open.windows(3).filter(|o| o[1] > o[0] && o[1] >= o[2]);
            assert!(turns.count() <= 1, "{open:?}");
        }
        let far = Estimate::new(75, 150);
        assert!(far.deviation > 0.9 && far.step_deviation > 0.99, "{far:?}");
        let near = Estimate::new(1, 150);
        assert!(
            near.deviation < 0.1 && near.step_deviation < 0.6,
            "{near:?}"
        );
    }

    #[test]
    fn the_estimate_goes_on_with_the_first_keyframes_velocity() {
        let [first, velocity, last] = Estimate::new(1, 100).weights;
        assert!((first - 1.0).abs() < 0.02, "{first}");
        assert!((0.8..1.0).contains(&velocity), "{velocity}");
        assert!(last.abs() < 0.01, "{last}");
    }
}

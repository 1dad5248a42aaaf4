//! The prior of a residual network: mean and deviation of a frame, given the keyframes.

use glam::{DMat3, DVec3};

use crate::autograd::Real;

/// Frames over which a number of a pose stays like itself, see [`correlation`].
const TIME: f64 = 8.0;
/// Correlation that stays at any distance: a dancer's own mean is not that of all.
const KEPT: f64 = 0.2;
/// Keeps the covariances regular where N is small; of the variance.
const NUGGET: f64 = 1e-6;

/// Correlation of a number of p^b with itself `frames` later: `KEPT + (1 - KEPT) (1 + d) exp(-d)`,
/// d = frames / TIME (Matern 3/2).
///
/// On training clips of the dance data (30 frames a second) that are set aside, the prior mean
/// is within an LRP of 12.3, 60.2, 73.2 and 76.5 cm at N = 10, 50, 100 and 150, lines between the
/// keyframes within 16.7, 64.4, 81.0 and 86.3 (`scripts/study_poses.py`).
fn correlation(frames: usize) -> f64 {
    let d = frames as f64 / TIME;
    KEPT + (1.0 - KEPT) * (1.0 + d) * (-d).exp()
}

/// Mean and deviation of the frames of a transition, by kriging (best linear prediction).
///
/// The means are linear in p^b and v^b of k1 and p^b of k2, as differences from theirs, with the
/// least expected square error where all numbers correlate as [`correlation`] says and a
/// velocity is the difference to the frame before: near the keyframes the motion goes on smoothly,
/// far from both it is the mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    /// N
    transition: usize,
    /// Of the covariances of p^b and v^b of k1 and p^b of k2.
    inverse: DMat3,
}

impl Prior {
    /// For transitions of N = `transition` frames.
    pub fn new(transition: usize) -> Self {
        let last = correlation(transition);
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

    /// Weights of p^b of k1, v^b of k1 (in deviations of p^b a frame) and p^b of k2 in the mean of
    /// frame k1 + `t`, `t` at most N.
    pub fn weights(&self, t: usize) -> [f64; 3] {
        (self.inverse * self.covariances(t)).to_array()
    }

    /// Standard deviation of the error of p^b in frame k1 + `t`, in deviations of p^b: 0 in the
    /// keyframes, near 1 far from them.
    pub fn deviation(&self, t: usize) -> f64 {
        self.left(1.0, self.covariances(t))
    }

    /// That of the step to frame k1 + `t` from the one before, as a share of the deviation of all
    /// steps; `t` from 1.
    pub fn step_deviation(&self, t: usize) -> f64 {
        let step = self.covariances(t) - self.covariances(t - 1);
        self.left(2.0 * (1.0 - correlation(1)), step)
    }

    /// Correlation of p^b in frame k1 + `t` with that of k1 and with that of k2.
    pub fn correlations(&self, t: usize) -> [f64; 2] {
        [correlation(t), correlation(self.transition - t)]
    }

    /// Covariances of what is given with p^b of frame k1 + `t`.
    fn covariances(&self, t: usize) -> DVec3 {
        DVec3::new(correlation(t), step(t), correlation(self.transition - t))
    }

    /// What is left of the deviation of a number of this variance and these covariances with what
    /// is given, as a share.
    fn left(&self, variance: f64, covariances: DVec3) -> f64 {
        let known = covariances.dot(self.inverse * covariances);
        (1.0 - known / variance).max(0.0).sqrt()
    }
}

/// The mean of a number of p^b, from [`Prior::weights`] and p^b and v^b of k1 and p^b of
/// k2, in deviations of p^b.
pub(super) fn mean<T: Real>(weights: [T; 3], ends: [T; 3]) -> T {
    weights[0] * ends[0] + weights[1] * ends[1] + weights[2] * ends[2]
}

/// Covariance of p^b with v^b `frames` earlier.
fn step(frames: usize) -> f64 {
    correlation(frames) - correlation(frames + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keyframe_is_its_own_mean() {
        for n in [1, 2, 10, 150, 1000] {
            for (t, expected) in [(0, [1.0, 0.0, 0.0]), (n, [0.0, 0.0, 1.0])] {
                for (weight, expected) in Prior::new(n).weights(t).into_iter().zip(expected) {
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
        let [first, velocity, last] = Prior::new(1000).weights(500);
        // KEPT from two poses that share it; of the first one two frames are known, and count
        // together.
        for weight in [first, last, -2.0 * velocity] {
            assert!((weight - KEPT / (1.0 + KEPT)).abs() < 2e-3, "{weight}");
        }
    }

    #[test]
    fn what_is_open_is_nothing_in_the_keyframes_and_nearly_all_far_from_them() {
        for n in [1, 2, 10, 150] {
            for t in [0, n] {
                let deviation = Prior::new(n).deviation(t);
                assert!(deviation < 2e-3, "N = {n}, t = {t}: {deviation}");
            }
            let deviations: Vec<f64> = (0..=n).map(|t| Prior::new(n).deviation(t)).collect();
            assert!(
                deviations
                    .iter()
                    .all(|deviation| (0.0..1.0).contains(deviation)),
                "{deviations:?}"
            );
            // Rises to one frame between the keyframes and falls after it.
            let turns = deviations
                .windows(3)
                .filter(|o| o[1] > o[0] && o[1] >= o[2]);
            assert!(turns.count() <= 1, "{deviations:?}");
        }
        let long = Prior::new(150);
        let deviations = |t: usize| (long.deviation(t), long.step_deviation(t));
        let (far, near) = (deviations(75), deviations(1));
        assert!(far.0 > 0.9 && far.1 > 0.99, "{far:?}");
        assert!(near.0 < 0.1 && near.1 < 0.6, "{near:?}");
    }

    #[test]
    fn the_mean_goes_on_with_the_first_keyframes_velocity() {
        let [first, velocity, last] = Prior::new(100).weights(1);
        assert!((first - 1.0).abs() < 0.02, "{first}");
        assert!((0.8..1.0).contains(&velocity), "{velocity}");
        assert!(last.abs() < 0.01, "{last}");
    }
}

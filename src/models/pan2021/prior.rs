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
/// On training clips of the dance data (30 frames a second) that are set aside, the prior mean is
/// within an LRP of 12.3, 60.2, 73.2 and 76.5 cm at N = 10, 50, 100 and 150, lines between the
/// keyframes within 16.7, 64.4, 81.0 and 86.3 (`scripts/study_poses.py`).
fn correlation(frames: usize) -> f64 {
    let d = frames as f64 / TIME;
    KEPT + (1.0 - KEPT) * (1.0 + d) * (-d).exp()
}

/// Mean and deviation of the frames of a transition, by kriging (best linear prediction).
///
/// The means are linear in p^b and v^b of k1 and p^b of k2, as differences from theirs, with the
/// least expected square error where numbers d frames apart correlate by `0.2 + 0.8 (1 + d / 8)
/// exp(-d / 8)` (Matern 3/2) and a velocity is the difference to the frame before: near the
/// keyframes the motion goes on smoothly, far from both it is the mean.
#[derive(Debug, Clone, Copy)]
pub struct Prior {
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

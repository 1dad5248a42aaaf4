//! What a residual network's numbers are added to: the best linear estimate of a frame from the keyframes.

/// Frames over which a number of a pose loses its likeness to itself, see [`likeness`].
const TIME: f64 = 8.0;
/// What of the likeness stays at any distance: a dancer's own mean is not that of all.
const KEPT: f64 = 0.2;
/// Keeps the system of [`weights`] regular where N is small; of the variance.
const NUGGET: f64 = 1e-6;

/// Correlation of a number of p^b with itself `frames` later: `KEPT + (1 - KEPT) (1 + d) exp(-d)`, d = frames / TIME (Matern 3/2).
///
/// Of training clips of the dance data at 30 frames a second: measured with the mean of all p^b, an estimate with it leaves 12.3, 60.4,
/// 74.0 and 78.1 cm LRP at N = 10, 50, 100 and 150 on clips set aside; with the measured correlations 12.3, 61.7, 74.6 and 78.7 (of each
/// number its own: 12.2, 60.4, 73.5 and 77.7); lines between the keyframes 15.0, 64.4, 81.7 and 87.7.
fn likeness(frames: usize) -> f64 {
    let d = frames as f64 / TIME;
    KEPT + (1.0 - KEPT) * (1.0 + d) * (-d).exp()
}

/// Weights of p^b and v^b of k1 and of p^b of k2, as differences from their means, in the estimate of frame k1 + `t`; `t` at most N =
/// `transition`.
///
/// The linear estimate with the least expected square error (kriging) where all numbers correlate as [`likeness`] says and a velocity is
/// the difference to the frame before: near the keyframes the motion goes on smoothly, far from both it is the mean.
pub(super) fn weights(t: usize, transition: usize) -> [f64; 3] {
    let n = transition;
    let step = |frames: usize| likeness(frames) - likeness(frames + 1);
    let given = [
        [1.0 + NUGGET, step(0), likeness(n)],
        [step(0), (2.0 + NUGGET) * step(0), step(n)],
        [likeness(n), step(n), 1.0 + NUGGET],
    ];
    solve(given, [likeness(t), step(t), likeness(n - t)])
}

/// x of `a x = b` for a symmetric positive definite `a`.
fn solve(a: [[f64; 3]; 3], b: [f64; 3]) -> [f64; 3] {
    let a = glam::DMat3::from_cols_array_2d(&a);
    (a.inverse() * glam::DVec3::from_array(b)).to_array()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_keyframe_is_estimated_by_itself() {
        for n in [1, 2, 10, 150, 1000] {
            for (t, expected) in [(0, [1.0, 0.0, 0.0]), (n, [0.0, 0.0, 1.0])] {
                for (weight, expected) in weights(t, n).into_iter().zip(expected) {
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
        let [first, velocity, last] = weights(500, 1000);
        // KEPT from two poses that share it; of the first one two frames are known, and count together.
        for weight in [first, last, -2.0 * velocity] {
            assert!((weight - KEPT / (1.0 + KEPT)).abs() < 2e-3, "{weight}");
        }
    }

    #[test]
    fn the_estimate_goes_on_with_the_first_keyframes_velocity() {
        let [first, velocity, last] = weights(1, 100);
        assert!((first - 1.0).abs() < 0.02, "{first}");
        assert!((0.8..1.0).contains(&velocity), "{velocity}");
        assert!(last.abs() < 0.01, "{last}");
    }
}

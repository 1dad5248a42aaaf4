//! How abruptly the joints of a dance are accelerated.

use glam::DVec3;

use super::FRAMES_PER_SECOND;

/// Mean jerk of the joints, a mean over joints and frames of the norm of the third difference
/// times 30^3: in the unit of the positions per s^3.
///
/// `world`: positions of the joints, `[frames][joints]`, 30 frames a second; 0 of fewer than 4.
#[must_use]
pub fn mean_jerk(world: &[Vec<DVec3>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for frames in world.windows(4) {
        let [a, b, c, d] = frames else { continue };
        for (((a, b), c), d) in a.iter().zip(b).zip(c).zip(d) {
            // By steps, so that what stands still has exactly none.
            let [first, second, third] = [*b - *a, *c - *b, *d - *c];
            sum += ((third - second) - (second - first)).length();
            count += 1;
        }
    }
    sum * FRAMES_PER_SECOND.powi(3) / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::mean_jerk;

    #[test]
    fn a_cubic_path_has_a_constant_jerk_and_a_parabola_none() {
        let path = |power: i32| -> Vec<Vec<DVec3>> {
            let at = |t: i32| f64::from(t).powi(power) / 30f64.powi(power);
            (0..9)
                .map(|t| vec![DVec3::Y * at(t), DVec3::new(0.0, 0.0, 7.0)])
                .collect()
        };
        // The third derivative of t^3 is 6; the second joint rests.
        assert!((mean_jerk(&path(3)) - 3.0).abs() < 1e-9);
        assert!(mean_jerk(&path(2)) < 1e-9);
        assert_eq!(mean_jerk(&path(3)[..3]), 0.0);
    }
}

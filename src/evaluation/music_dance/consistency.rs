//! How well a dance keeps to its key poses.

use glam::DVec3;

/// Consistency error of a key pose (eq. 13): the squared norm of the difference from what was made
/// at its frame, the **sum** over the 6 J numbers of rotations, as a mean of theirs could not be as
/// large as what Pu and Shan print. No unit.
///
/// Both are 6-D rotations of all joints, `[6 J]`; the shorter one's length counts.
#[must_use]
pub fn consistency_error<'n>(
    key: impl IntoIterator<Item = &'n f64>,
    made: impl IntoIterator<Item = &'n f64>,
) -> f64 {
    let pairs = key.into_iter().zip(made);
    pairs.map(|(key, made)| (key - made).powi(2)).sum()
}

/// Distance of the joints from where they should be, about the root (both roots laid on each
/// other): a mean over all joints, the root's 0 among them, in the unit of the positions.
///
/// Both are positions in the world, `[joints]`, the root first; 0 of none.
#[must_use]
pub fn distance_about_root(wanted: &[DVec3], made: &[DVec3]) -> f64 {
    let (Some(&wanted_root), Some(&made_root)) = (wanted.first(), made.first()) else {
        return 0.0;
    };
    let pairs = wanted.iter().zip(made);
    let distances = pairs.map(|(a, b)| (*a - wanted_root).distance(*b - made_root));
    distances.sum::<f64>() / wanted.len() as f64
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::{consistency_error, distance_about_root};

    #[test]
    fn the_error_is_a_sum_over_numbers() {
        assert_eq!(consistency_error(&[1.0, 2.0, 0.0], &[0.0, 4.0, 0.0]), 5.0);
    }

    #[test]
    fn the_distance_is_a_mean_over_all_joints_and_blind_to_the_roots_place() {
        let wanted = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let away = DVec3::new(5.0, -3.0, 2.0);
        let made = [away, away + DVec3::X, away + 4.0 * DVec3::Y];
        assert!((distance_about_root(&wanted, &made) - 1.0).abs() < 1e-12);
    }
}

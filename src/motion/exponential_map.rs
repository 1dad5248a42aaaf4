//! A rotation as three numbers: its angle times its axis.

use glam::{DQuat, DVec3};

/// The exponential map of a rotation: angle in [0, pi] times axis, rad. `q` is a unit quaternion.
///
/// At an angle of pi both signs name the same rotation; from one side of it to the other the
/// numbers jump by 2 pi.
#[must_use]
pub fn exponential_map(q: DQuat) -> DVec3 {
    // Both signs of a quaternion are one rotation; the other one's angle is at most pi.
    let q = if q.w < 0.0 { -q } else { q };
    let sine = q.xyz().length();
    if sine == 0.0 {
        return DVec3::ZERO;
    }
    q.xyz() * (2.0 * sine.atan2(q.w) / sine)
}

/// The rotation of an exponential map of any length, rad.
#[must_use]
pub fn from_exponential_map(map: DVec3) -> DQuat {
    let angle = map.length();
    // sin(x / 2) / x, whose limit at 0 is 1/2.
    let scale = match angle {
        0.0 => 0.5,
        angle => (0.5 * angle).sin() / angle,
    };
    let xyz = map * scale;
    DQuat::from_xyzw(xyz.x, xyz.y, xyz.z, (0.5 * angle).cos())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::{DQuat, DVec3};

    use super::{exponential_map, from_exponential_map};

    fn axes() -> impl Iterator<Item = DVec3> {
        (0..20).map(|n| {
            let angle = |step: f64| (f64::from(n) * step + 0.3).sin();
            DVec3::new(angle(0.7), angle(1.3), angle(2.1)).normalize()
        })
    }

    #[test]
    fn angles_from_1e_minus_300_to_pi_come_back_to_the_last_digits() {
        for axis in axes() {
            for angle in [1e-300, 1e-12, 1e-8, 1e-3, 1.0, 3.0, PI - 1e-9, PI - 1e-14] {
                let map = axis * angle;
                for sign in [1.0, -1.0] {
                    let back = exponential_map(from_exponential_map(map) * sign);
                    let error = back.distance(map) / angle;
                    assert!(error < 1e-14, "{map} became {back}");
                }
            }
        }
    }

    #[test]
    fn it_is_the_angle_times_the_axis() {
        for axis in axes() {
            let q = DQuat::from_axis_angle(axis, 1.25);
            assert!(exponential_map(q).distance(axis * 1.25) < 1e-15);
            assert!(from_exponential_map(axis * 1.25).abs_diff_eq(q, 1e-15));
        }
        assert_eq!(exponential_map(DQuat::IDENTITY), DVec3::ZERO);
        assert_eq!(from_exponential_map(DVec3::ZERO), DQuat::IDENTITY);
    }

    #[test]
    fn no_angle_is_above_pi_and_beyond_it_the_axis_turns_round() {
        for axis in axes() {
            let map = exponential_map(from_exponential_map(axis * (PI + 0.1)));
            assert!(map.distance(axis * (0.1 - PI)) < 1e-14, "{map}");
            let half = exponential_map(from_exponential_map(axis * PI));
            assert!((half.length() - PI).abs() < 1e-15, "{half}");
        }
    }
}

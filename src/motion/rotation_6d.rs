//! A rotation as six numbers: the first two columns of its matrix, continuous where angles and
//! quaternions jump (Zhou et al., "On the continuity of rotation representations in neural
//! networks", CVPR 2019).

use glam::{DMat3, DQuat, DVec3};

/// First, then second column of the rotation's matrix. `q` is a unit quaternion.
#[must_use]
pub fn rotation_6d(q: DQuat) -> [f64; 6] {
    let (first, second) = (q * DVec3::X, q * DVec3::Y);
    [first.x, first.y, first.z, second.x, second.y, second.z]
}

/// The rotation of six numbers that need not be columns of one, by Gram-Schmidt: the first three
/// made unit, the next three made perpendicular to them and unit, the third column their cross
/// product.
///
/// The identity where they name none: a column of zeros, both along one line, or a number that is
/// not finite.
#[must_use]
pub fn from_6d([a, b, c, d, e, f]: [f64; 6]) -> DQuat {
    let rotation = || {
        // Unit first: the product of two long columns would lose the second one's own direction.
        let first = DVec3::new(a, b, c).try_normalize()?;
        let second = DVec3::new(d, e, f).try_normalize()?;
        let across = second.reject_from_normalized(first);
        // Below this the direction is rounding alone.
        let second = (across.length() > 1e-12).then(|| across.normalize())?;
        let columns = DMat3::from_cols(first, second, first.cross(second));
        Some(DQuat::from_mat3(&columns).normalize())
    };
    rotation().unwrap_or(DQuat::IDENTITY)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use glam::{DQuat, DVec3, EulerRot};

    use super::{from_6d, rotation_6d};

    fn some_rotations() -> impl Iterator<Item = DQuat> {
        let angle = |n: usize, step: f64| (n as f64 * step).sin() * 3.0;
        (0..50).map(move |n| {
            let angles = [angle(n, 0.7), angle(n, 1.3), angle(n, 2.1)];
            DQuat::from_euler(EulerRot::XYZ, angles[0], angles[1], angles[2])
        })
    }

    #[test]
    fn the_columns_of_a_quarter_turn_about_y_are_those_of_its_matrix() {
        // x goes to -z, y stays.
        let numbers = rotation_6d(DQuat::from_rotation_y(FRAC_PI_2));
        for (number, expected) in numbers.into_iter().zip([0.0, 0.0, -1.0, 0.0, 1.0, 0.0]) {
            assert!((number - expected).abs() < 1e-15, "{numbers:?}");
        }
    }

    #[test]
    fn back_and_forth_is_the_same_rotation_whatever_the_lengths_and_the_lean() {
        for q in some_rotations() {
            let [a, b, c, d, e, f] = rotation_6d(q);
            let scaled = [2.0 * a, 2.0 * b, 2.0 * c].into_iter();
            let leaning = [d + 0.5 * a, e + 0.5 * b, f + 0.5 * c];
            let numbers: Vec<f64> = scaled.chain(leaning).collect();
            for numbers in [[a, b, c, d, e, f], numbers.try_into().unwrap()] {
                let back = from_6d(numbers);
                for axis in DVec3::AXES {
                    assert!(
                        (back * axis).distance(q * axis) < 1e-12,
                        "{q} became {back}"
                    );
                }
            }
        }
    }

    #[test]
    fn numbers_that_name_no_rotation_give_the_identity() {
        for numbers in [
            [0.0; 6],
            [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 2.0, 3.0, -2.0, -4.0, -6.0],
            [f64::NAN, 0.0, 0.0, 0.0, 1.0, 0.0],
            [1.0, 0.0, 0.0, f64::INFINITY, 1.0, 0.0],
        ] {
            assert_eq!(from_6d(numbers), DQuat::IDENTITY, "{numbers:?}");
        }
    }
}

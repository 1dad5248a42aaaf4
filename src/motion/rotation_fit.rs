//! The rotation that best takes some directions to others.

use glam::{DQuat, DVec3};

/// The rotation R with the least sum of `|R a - b|^2` over pairs (a, b); none for no pairs.
///
/// One pair: the shortest arc from a to b. More: Horn's method, the eigenvector of the largest
/// eigenvalue of a symmetric 4 x 4 matrix of the pairs' products, found by Jacobi rotations. Where
/// several rotations are equally good (all pairs on one line) it is one of them.
pub fn best_rotation(pairs: &[(DVec3, DVec3)]) -> DQuat {
    match pairs {
        [] => DQuat::IDENTITY,
        [(a, b)] => DQuat::from_rotation_arc(a.normalize(), b.normalize()),
        _ => horn(pairs),
    }
}

/// Horn 1987, "Closed-form solution of absolute orientation using unit quaternions", without
/// translation and scale.
fn horn(pairs: &[(DVec3, DVec3)]) -> DQuat {
    let sum =
        |row: usize, column: usize| -> f64 { pairs.iter().map(|(a, b)| a[row] * b[column]).sum() };
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] =
        std::array::from_fn(|row| std::array::from_fn(|column| sum(row, column)));
    // Quaternions in the order w, x, y, z.
    let matrix = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let [w, x, y, z] = leading_eigenvector(matrix);
    DQuat::from_xyzw(x, y, z, w).normalize()
}

/// Unit eigenvector of the largest eigenvalue of a symmetric matrix, by cyclic Jacobi rotations.
fn leading_eigenvector(mut matrix: [[f64; 4]; 4]) -> [f64; 4] {
    let mut vectors = [[0.0; 4]; 4];
    for (index, row) in vectors.iter_mut().enumerate() {
        row[index] = 1.0;
    }
    let pairs = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
    let size: f64 = matrix.iter().flatten().map(|x| x.abs()).sum();
    // Jacobi converges quadratically: a 4 x 4 matrix needs about 6 sweeps to the last bit.
    for _ in 0..16 {
        let off: f64 = pairs.iter().map(|&(p, q)| matrix[p][q].abs()).sum();
        if off <= 1e-15 * size {
            break;
        }
        for (p, q) in pairs {
            rotate(&mut matrix, &mut vectors, p, q);
        }
    }
    let largest = (1..4).fold(0, |best, index| {
        if matrix[index][index] > matrix[best][best] {
            index
        } else {
            best
        }
    });
    vectors.map(|row| row[largest])
}

/// One Jacobi rotation: makes `matrix[p][q]` zero and turns the columns of `vectors` along.
fn rotate(matrix: &mut [[f64; 4]; 4], vectors: &mut [[f64; 4]; 4], p: usize, q: usize) {
    let apq = matrix[p][q];
    if apq == 0.0 {
        return;
    }
    let theta = (matrix[q][q] - matrix[p][p]) / (2.0 * apq);
    let tangent = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cosine = tangent.hypot(1.0).recip();
    let sine = tangent * cosine;
    let mix = |a: f64, b: f64| (cosine * a - sine * b, sine * a + cosine * b);
    for row in matrix.iter_mut().chain(vectors) {
        (row[p], row[q]) = mix(row[p], row[q]);
    }
    let (mut upper, mut lower) = (matrix[p], matrix[q]);
    for (a, b) in upper.iter_mut().zip(&mut lower) {
        (*a, *b) = mix(*a, *b);
    }
    (matrix[p], matrix[q]) = (upper, lower);
}

//! The linear system whose solution is nearest to what is asked, smooth and of the speed that is
//! asked for.

/// The matrix of the linear system in frames k1 + 1 .. k2 - 1 as L D L^T, L with ones in its main
/// diagonal and two diagonals below.
pub struct System {
    diagonal: Vec<f64>,
    /// L in row t + 1 and t + 2 of column t.
    below: Vec<[f64; 2]>,
}

impl System {
    /// For transitions of `length` frames, with these weights of steps and of second differences;
    /// values themselves have weight 1.
    pub fn new(length: usize, step_weight: f64, acceleration_weight: f64) -> Self {
        let mut matrix = vec![[0.0; 3]; length + 1]; // columns t, t + 1, t + 2 of row t
        for row in &mut matrix {
            row[0] = 1.0;
        }
        for t in 0..length {
            matrix[t][0] += step_weight;
            matrix[t + 1][0] += step_weight;
            matrix[t][1] -= step_weight;
        }
        for t in 1..length {
            matrix[t - 1][0] += acceleration_weight;
            matrix[t - 1][1] -= 2.0 * acceleration_weight;
            matrix[t - 1][2] += acceleration_weight;
            matrix[t][0] += 4.0 * acceleration_weight;
            matrix[t][1] -= 2.0 * acceleration_weight;
            matrix[t + 1][0] += acceleration_weight;
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
    pub fn solve<const NUMBERS: usize>(&self, right: &mut [[f64; NUMBERS]]) {
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

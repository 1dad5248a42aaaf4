//! What attention does inside one small window: products of a few rows, and the softmax of their
//! scores.
//!
//! A window has so few tokens that a general product would spend its time on packing. Here [`ROWS`]
//! rows are done at once, their sums in registers, so that the sums do not wait for each other.
//! Rows of scores are padded to a multiple of [`CHUNK`] numbers.

use super::Real;

/// Numbers in a padded chunk of a row of scores.
pub const CHUNK: usize = 8;
/// Rows whose sums are made side by side.
const ROWS: usize = 4;
/// Numbers of a row that are summed at once.
const LANES: usize = 16;

/// Rows of a matrix, or columns of them: row r begins at `start + r * stride`.
#[derive(Clone, Copy)]
pub struct WindowRows<'v, T> {
    pub values: &'v [T],
    pub start: usize,
    pub stride: usize,
}

impl<'v, T> WindowRows<'v, T> {
    #[inline(always)]
    fn row(&self, row: usize, width: usize) -> &'v [T] {
        let from = self.start + row * self.stride;
        &self.values[from..from + width]
    }

    /// The rows from `first` on, with columns from `column` on.
    #[inline(always)]
    pub fn from(self, first: usize, column: usize) -> Self {
        Self {
            start: self.start + first * self.stride + column,
            ..self
        }
    }
}

/// Length that [`window_scores`] and [`window_sums`] need of their scratch.
pub fn scratch_len(rows: usize, width: usize) -> usize {
    rows.next_multiple_of(CHUNK) * width.next_multiple_of(LANES)
}

/// out[i, j] = scale * a_i . b_j, i below `rows`, j below `keys`, `out [rows, padded keys]`; the
/// padding gets 0.
#[inline(always)]
pub fn window_scores<T: Real>(
    out: &mut [T],
    a: WindowRows<'_, T>,
    (b, keys): (WindowRows<'_, T>, usize),
    width: usize,
    scale: T,
    scratch: &mut [T],
) {
    let padded = keys.next_multiple_of(CHUNK);
    // b transposed, [chunks, width, CHUNK].
    let transposed = &mut scratch[..padded * width];
    for chunk in 0..padded / CHUNK {
        let transposed = &mut transposed[chunk * width * CHUNK..][..width * CHUNK];
        for lane in 0..CHUNK {
            let j = chunk * CHUNK + lane;
            if j < keys {
                for (column, &x) in transposed.chunks_exact_mut(CHUNK).zip(b.row(j, width)) {
                    column[lane] = x;
                }
            } else {
                for column in transposed.chunks_exact_mut(CHUNK) {
                    column[lane] = T::zero();
                }
            }
        }
    }
    let rows = out.len() / padded;
    for (block, out) in out.chunks_mut(ROWS * padded).enumerate() {
        // Beyond the last row it is computed again, and not stored.
        let [a0, a1, a2, a3] =
            std::array::from_fn(|r| a.row((block * ROWS + r).min(rows - 1), width));
        for (chunk, b) in transposed.chunks_exact(width * CHUNK).enumerate() {
            let mut sums = [[T::zero(); CHUNK]; ROWS];
            for ((((b, &a0), &a1), &a2), &a3) in
                b.chunks_exact(CHUNK).zip(a0).zip(a1).zip(a2).zip(a3)
            {
                for lane in 0..CHUNK {
                    sums[0][lane] += a0 * b[lane];
                    sums[1][lane] += a1 * b[lane];
                    sums[2][lane] += a2 * b[lane];
                    sums[3][lane] += a3 * b[lane];
                }
            }
            for (out, sums) in out.chunks_exact_mut(padded).zip(sums) {
                for (out, sum) in out[chunk * CHUNK..][..CHUNK].iter_mut().zip(sums) {
                    *out = sum * scale;
                }
            }
        }
    }
}

/// The weights of a sum over rows: that of row j for result i is `values[i * result + j * row]`.
#[derive(Clone, Copy)]
pub struct WindowWeights<'w, T> {
    pub values: &'w [T],
    pub result: usize,
    pub row: usize,
}

/// out_i (+)= sum_j weight(i, j) x_j, i below `results`, j below `rows`; rows of `out` begin
/// `stride` apart.
#[inline(always)]
pub fn window_sums<T: Real>(
    (out, stride, results): (&mut [T], usize, usize),
    weights: WindowWeights<'_, T>,
    (x, rows): (WindowRows<'_, T>, usize),
    width: usize,
    accumulate: bool,
    scratch: &mut [T],
) {
    // x in whole vectors.
    let wide = width.next_multiple_of(LANES);
    let x = if wide == width {
        x
    } else {
        let gathered = &mut scratch[..rows * wide];
        for (j, row) in gathered.chunks_exact_mut(wide).enumerate() {
            let (row, padding) = row.split_at_mut(width);
            row.copy_from_slice(x.row(j, width));
            padding.fill(T::zero());
        }
        WindowRows {
            values: gathered,
            start: 0,
            stride: wide,
        }
    };
    for first in (0..results).step_by(ROWS) {
        let here = (results - first).min(ROWS);
        // Beyond the last result it is computed again, and not stored.
        let weights_of: [&[T]; ROWS] = std::array::from_fn(|r| {
            &weights.values[(first + r).min(results - 1) * weights.result..]
        });
        for column in (0..width).step_by(LANES) {
            let n = (width - column).min(LANES);
            let mut edges = [[T::zero(); LANES]; ROWS];
            if accumulate {
                for (r, edge) in edges.iter_mut().enumerate().take(here) {
                    copy(&mut edge[..n], &out[(first + r) * stride + column..][..n]);
                }
            }
            // Sums of their own, as the compiler keeps no array in registers that is cut at a place
            // it does not know.
            let mut sums = edges;
            for j in 0..rows {
                let x = &x.row(j, wide)[column..column + LANES];
                for r in 0..ROWS {
                    let weight = weights_of[r][j * weights.row];
                    for lane in 0..LANES {
                        sums[r][lane] += weight * x[lane];
                    }
                }
            }
            edges = sums;
            for (r, edge) in edges.iter().enumerate().take(here) {
                copy(&mut out[(first + r) * stride + column..][..n], &edge[..n]);
            }
        }
    }
}

/// Copies slices of one length; a whole vector without a call.
#[inline(always)]
fn copy<T: Real>(to: &mut [T], from: &[T]) {
    match (
        <&mut [T; LANES]>::try_from(&mut *to),
        <&[T; LANES]>::try_from(from),
    ) {
        (Ok(to), Ok(from)) => *to = *from,
        _ => to.iter_mut().zip(from).for_each(|(to, &from)| *to = from),
    }
}

/// All of a chunk's numbers in one, halves first: the same tree whatever the instruction set.
#[inline(always)]
fn fold<T: Real>(x: [T; CHUNK], f: impl Fn(T, T) -> T) -> T {
    let [a, b, c, d] = [f(x[0], x[4]), f(x[1], x[5]), f(x[2], x[6]), f(x[3], x[7])];
    f(f(a, c), f(b, d))
}

/// Softmax over the first `keys` numbers of each padded row; the padding becomes 0.
#[inline(always)]
pub fn window_softmax<T: Real>(rows: &mut [T], keys: usize) {
    let padded = keys.next_multiple_of(CHUNK);
    // A NaN need not win here: its own exponential puts it into the sum.
    let max = |a: T, b: T| if a > b { a } else { b };
    for row in rows.chunks_exact_mut(padded) {
        row[keys..].fill(T::neg_infinity());
        let mut lanes = [T::neg_infinity(); CHUNK];
        for chunk in row.chunks_exact(CHUNK) {
            for (lane, &x) in lanes.iter_mut().zip(chunk) {
                *lane = max(*lane, x);
            }
        }
        let top = fold(lanes, max);
        let mut lanes = [T::zero(); CHUNK];
        for chunk in row.chunks_exact_mut(CHUNK) {
            for (lane, x) in lanes.iter_mut().zip(chunk) {
                *x = (*x - top).exp_lane();
                *lane += *x;
            }
        }
        let inverse = T::one() / fold(lanes, |a, b| a + b);
        row.iter_mut().for_each(|x| *x *= inverse);
    }
}

/// dS = scale P (dP - rowsum(dP P)) in place of dP, for padded rows.
#[inline(always)]
pub fn window_softmax_backward<T: Real>(dp: &mut [T], p: &[T], keys: usize, scale: T) {
    let padded = keys.next_multiple_of(CHUNK);
    for (dp, p) in dp.chunks_exact_mut(padded).zip(p.chunks_exact(padded)) {
        let mut lanes = [T::zero(); CHUNK];
        for (dp, p) in dp.chunks_exact(CHUNK).zip(p.chunks_exact(CHUNK)) {
            for lane in 0..CHUNK {
                lanes[lane] += dp[lane] * p[lane];
            }
        }
        let sum = fold(lanes, |a, b| a + b);
        for (dp, &p) in dp.iter_mut().zip(p) {
            *dp = p * (*dp - sum) * scale;
        }
    }
}

//! What attention does inside one small window: products of a few rows, and the softmax of their
//! scores.
//!
//! A window has so few tokens that a general product would spend its time on packing. Here [`ROWS`]
//! rows are done at once, their sums in registers, so that the sums do not wait for each other.
//! Rows of scores are padded to a multiple of [`CHUNK`] numbers.

use super::{Mat, Real};

/// Numbers in a padded chunk of a row of scores.
pub const CHUNK: usize = 8;
/// Rows whose sums are made side by side.
const ROWS: usize = 4;
/// Rows of scores that are in the first-level cache between the passes of their softmax.
const SOFTMAX_ROWS: usize = 32;
/// Numbers of a row that are summed at once, for narrow rows and for others.
const NARROW: usize = 4;
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

    /// So many rows and columns, as a general product reads them.
    pub fn matrix(self, rows: usize, width: usize) -> Mat<'v, T> {
        Mat::strided(&self.values[self.start..], rows, width, self.stride)
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

/// The weights of a sum over rows, in padded rows of scores.
#[derive(Clone, Copy)]
pub struct WindowWeights<'w, T> {
    pub values: &'w [T],
    /// Length of a padded row.
    pub padded: usize,
    /// Whether a sum has a column of weights, else a row of them: that of row j for result i is at
    /// `j * padded + i`, else at `i * padded + j`.
    pub columns: bool,
}

/// out_i (+)= sum_j weight(i, j) x_j, i below `results`, j below `rows`; rows of `out` begin
/// `stride` apart.
#[inline(always)]
pub fn window_sums<T: Real>(
    out: (&mut [T], usize, usize),
    weights: WindowWeights<'_, T>,
    x: (WindowRows<'_, T>, usize),
    width: usize,
    accumulate: bool,
    scratch: &mut [T],
) {
    if width <= NARROW {
        sums_of_lanes::<T, NARROW>(out, weights, x, width, accumulate, scratch);
    } else {
        sums_of_lanes::<T, LANES>(out, weights, x, width, accumulate, scratch);
    }
}

/// [`window_sums`], `LANES` columns at once.
#[inline(always)]
fn sums_of_lanes<T: Real, const LANES: usize>(
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
    let WindowWeights {
        values,
        padded,
        columns,
    } = weights;
    for first in (0..results).step_by(ROWS) {
        let here = (results - first).min(ROWS);
        // Beyond the last result sums are made, too, and not stored: of its weights again, or of
        // those in the padding, which is a multiple of ROWS.
        let row_of: [&[T]; ROWS] = std::array::from_fn(|r| match columns {
            true => &[],
            false => &values[(first + r).min(results - 1) * padded..][..rows],
        });
        for column in (0..width).step_by(LANES) {
            let n = (width - column).min(LANES);
            let mut edges = [[T::zero(); LANES]; ROWS];
            if accumulate {
                for (r, edge) in edges.iter_mut().enumerate().take(here) {
                    copy::<T, LANES>(&mut edge[..n], &out[(first + r) * stride + column..][..n]);
                }
            }
            let x = |j| &x.row(j, wide)[column..column + LANES];
            edges = if columns {
                let weights = |j: usize, r: usize| values[j * padded + first..][..ROWS][r];
                add_up(edges, rows, weights, x)
            } else {
                add_up(edges, rows, |j, r| row_of[r][j], x)
            };
            for (r, edge) in edges.iter().enumerate().take(here) {
                copy::<T, LANES>(&mut out[(first + r) * stride + column..][..n], &edge[..n]);
            }
        }
    }
}

/// sums_r + sum_j weight(j, r) x_j, j below `rows`. The sums are this function's own, as the
/// compiler keeps no array in registers that is cut at a place it does not know.
#[inline(always)]
fn add_up<'x, T: Real, const LANES: usize>(
    mut sums: [[T; LANES]; ROWS],
    rows: usize,
    weight: impl Fn(usize, usize) -> T,
    x: impl Fn(usize) -> &'x [T],
) -> [[T; LANES]; ROWS] {
    for j in 0..rows {
        let x = x(j);
        for (r, sums) in sums.iter_mut().enumerate() {
            let weight = weight(j, r);
            for lane in 0..LANES {
                sums[lane] += weight * x[lane];
            }
        }
    }
    sums
}

/// Copies slices of one length; a whole vector without a call.
#[inline(always)]
fn copy<T: Real, const LANES: usize>(to: &mut [T], from: &[T]) {
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
    // Pass by pass over a few rows, so that the exponentials do not wait for each row's maximum.
    for block in rows.chunks_mut(padded * SOFTMAX_ROWS) {
        for row in block.chunks_exact_mut(padded) {
            row[keys..].fill(T::neg_infinity());
            let mut lanes = [T::neg_infinity(); CHUNK];
            for chunk in row.chunks_exact(CHUNK) {
                for (lane, &x) in lanes.iter_mut().zip(chunk) {
                    *lane = max(*lane, x);
                }
            }
            let top = fold(lanes, max);
            row.iter_mut().for_each(|x| *x -= top);
        }
        for x in &mut *block {
            *x = x.exp_lane();
        }
        for row in block.chunks_exact_mut(padded) {
            let mut lanes = [T::zero(); CHUNK];
            for chunk in row.chunks_exact(CHUNK) {
                for (lane, &x) in lanes.iter_mut().zip(chunk) {
                    *lane += x;
                }
            }
            let inverse = T::one() / fold(lanes, |a, b| a + b);
            row.iter_mut().for_each(|x| *x *= inverse);
        }
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

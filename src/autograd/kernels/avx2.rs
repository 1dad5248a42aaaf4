//! f32 kernels in AVX2 with FMA: tiles of up to 6 rows and 16 columns.

use std::arch::x86_64::*;

use super::blocked::{Kernels, LEFT_STEP, Rows, Tile, rows};

/// The kernels of AVX2.
pub static KERNELS: Kernels = Kernels {
    width: 16,
    rows: rows!(1 * 4, 2 * 2, 3 * 1, 4 * 1, 5 * 1, 6 * 1),
    transpose,
};

/// A tile of `ROWS` rows and the first `VECTORS` times 8 columns of `PANELS` panels; see
/// [`super::blocked::Kernel`].
#[target_feature(enable = "avx2,fma")]
unsafe fn tile<const ROWS: usize, const PANELS: usize, const VECTORS: usize, const DIRECT: bool>(
    t: &Tile,
) {
    let mut sums = [[[_mm256_setzero_ps(); VECTORS]; PANELS]; ROWS];
    let (mut a, mut b) = (t.a, t.b);
    let (a_row, a_step) = if DIRECT { (t.a_row, 1) } else { (1, LEFT_STEP) };
    for _ in 0..t.k {
        // SAFETY: the caller vouches for k steps of A's rows and B's panels.
        unsafe {
            let mut columns = [[_mm256_setzero_ps(); VECTORS]; PANELS];
            for (q, columns) in columns.iter_mut().enumerate() {
                let panel = b.add(q * t.b_panel);
                for (v, column) in columns.iter_mut().enumerate() {
                    *column = _mm256_loadu_ps(panel.add(8 * v));
                }
            }
            for (i, sums) in sums.iter_mut().enumerate() {
                let x = _mm256_set1_ps(*a.add(i * a_row));
                for (sums, columns) in sums.iter_mut().zip(&columns) {
                    for (sum, &column) in sums.iter_mut().zip(columns) {
                        *sum = _mm256_fmadd_ps(x, column, *sum);
                    }
                }
            }
        }
        a = a.wrapping_add(a_step);
        b = b.wrapping_add(t.b_step);
    }
    for (i, sums) in sums.iter().enumerate() {
        for (part, &sum) in sums.as_flattened().iter().enumerate() {
            let first = 8 * part;
            if first >= t.cols {
                break;
            }
            // SAFETY: row i and the columns up to `cols` are within the caller's C.
            unsafe {
                let c = t.c.add(i * t.c_row + first);
                if t.cols - first >= 8 {
                    let sum = if t.accumulate {
                        _mm256_add_ps(_mm256_loadu_ps(c), sum)
                    } else {
                        sum
                    };
                    _mm256_storeu_ps(c, sum);
                } else {
                    let mut parts = [0.0; 8];
                    _mm256_storeu_ps(parts.as_mut_ptr(), sum);
                    for (j, &sum) in parts[..t.cols - first].iter().enumerate() {
                        let c = c.add(j);
                        *c = if t.accumulate { *c + sum } else { sum };
                    }
                }
            }
        }
    }
}

/// Transposes in blocks of 8 by 8; see [`super::blocked::Transpose`].
#[target_feature(enable = "avx2,fma")]
pub unsafe fn transpose(
    from: *const f32,
    stride: usize,
    rows: usize,
    cols: usize,
    to: *mut f32,
    width: usize,
) {
    let whole = cols / 8 * 8;
    for first in (0..width).step_by(8) {
        let valid = rows.saturating_sub(first).min(8);
        for col in (0..whole).step_by(8) {
            let mut block = [_mm256_setzero_ps(); 8];
            // SAFETY: rows below `rows` and eight columns from `col` on are valid to read, eight
            // numbers in each of eight rows of the result to write.
            unsafe {
                for (r, row) in block.iter_mut().enumerate() {
                    if r < valid {
                        *row = _mm256_loadu_ps(from.add((first + r) * stride + col));
                    }
                }
                for (c, &row) in transposed(block).iter().enumerate() {
                    _mm256_storeu_ps(to.add((col + c) * width + first), row);
                }
            }
        }
        for col in whole..cols {
            for r in 0..8 {
                // SAFETY: as above, one element at a time.
                unsafe {
                    *to.add(col * width + first + r) = if r < valid {
                        *from.add((first + r) * stride + col)
                    } else {
                        0.0
                    };
                }
            }
        }
    }
}

/// The transpose of an 8 by 8 block.
#[target_feature(enable = "avx2,fma")]
#[inline]
fn transposed(r: [__m256; 8]) -> [__m256; 8] {
    let low = |i: usize| _mm256_unpacklo_ps(r[i], r[i + 1]);
    let high = |i: usize| _mm256_unpackhi_ps(r[i], r[i + 1]);
    let pairs = [
        low(0),
        high(0),
        low(2),
        high(2),
        low(4),
        high(4),
        low(6),
        high(6),
    ];
    let even = |i: usize| _mm256_shuffle_ps::<0b01_00_01_00>(pairs[i], pairs[i + 2]);
    let odd = |i: usize| _mm256_shuffle_ps::<0b11_10_11_10>(pairs[i], pairs[i + 2]);
    let fours = [
        even(0),
        odd(0),
        even(1),
        odd(1),
        even(4),
        odd(4),
        even(5),
        odd(5),
    ];
    let front = |i: usize| _mm256_permute2f128_ps::<0x20>(fours[i], fours[i + 4]);
    let back = |i: usize| _mm256_permute2f128_ps::<0x31>(fours[i], fours[i + 4]);
    [
        front(0),
        front(1),
        front(2),
        front(3),
        back(0),
        back(1),
        back(2),
        back(3),
    ]
}

//! f32 kernels in AVX-512: tiles of up to 14 rows and 32 columns.

use std::arch::x86_64::*;

use super::{
    avx2,
    blocked::{Kernels, LEFT_STEP, Rows, Tile, rows},
};

/// The kernels of AVX-512.
pub static KERNELS: Kernels = Kernels {
    width: 32,
    rows: rows!(
        1 * 4,
        2 * 4,
        3 * 2,
        4 * 2,
        5 * 2,
        6 * 2,
        7 * 1,
        8 * 1,
        9 * 1,
        10 * 1,
        11 * 1,
        12 * 1,
        13 * 1,
        14 * 1
    ),
    transpose: avx2::transpose,
};

/// A tile of `ROWS` rows and the first `VECTORS` times 16 columns of `PANELS` panels; see
/// [`super::blocked::Kernel`].
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
unsafe fn tile<const ROWS: usize, const PANELS: usize, const VECTORS: usize, const DIRECT: bool>(
    t: &Tile,
) {
    let mut sums = [[[_mm512_setzero_ps(); VECTORS]; PANELS]; ROWS];
    let (mut a, mut b) = (t.a, t.b);
    let (a_row, a_step) = if DIRECT { (t.a_row, 1) } else { (1, LEFT_STEP) };
    // C's lines come from afar while the sums are made.
    for i in 0..ROWS {
        for part in 0..PANELS * VECTORS {
            let c = t.c.wrapping_add(i * t.c_row + 16 * part);
            _mm_prefetch::<_MM_HINT_T0>(c.cast());
        }
    }
    for _ in 0..t.k {
        // SAFETY: the caller vouches for k steps of A's rows and B's panels.
        unsafe {
            let mut columns = [[_mm512_setzero_ps(); VECTORS]; PANELS];
            for (q, columns) in columns.iter_mut().enumerate() {
                let panel = b.add(q * t.b_panel);
                for (v, column) in columns.iter_mut().enumerate() {
                    *column = _mm512_loadu_ps(panel.add(16 * v));
                }
            }
            for (i, sums) in sums.iter_mut().enumerate() {
                let x = _mm512_set1_ps(*a.add(i * a_row));
                for (sums, columns) in sums.iter_mut().zip(&columns) {
                    for (sum, &column) in sums.iter_mut().zip(columns) {
                        *sum = _mm512_fmadd_ps(x, column, *sum);
                    }
                }
            }
        }
        a = a.wrapping_add(a_step);
        b = b.wrapping_add(t.b_step);
    }
    for (i, sums) in sums.iter().enumerate() {
        for (part, &sum) in sums.as_flattened().iter().enumerate() {
            let first = 16 * part;
            if first >= t.cols {
                break;
            }
            let mask = if t.cols - first >= 16 {
                0xffff
            } else {
                (1 << (t.cols - first)) - 1
            };
            // SAFETY: row i and the columns under the mask are within the caller's C.
            unsafe {
                let c = t.c.add(i * t.c_row + first);
                let sum = if t.accumulate {
                    _mm512_add_ps(_mm512_maskz_loadu_ps(mask, c), sum)
                } else {
                    sum
                };
                _mm512_mask_storeu_ps(c, mask, sum);
            }
        }
    }
}

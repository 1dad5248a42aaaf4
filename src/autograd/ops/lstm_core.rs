//! The gates of an LSTM: what [`super::lstm_cell`] and [`super::lstm_gates`] share.
//!
//! ```text
//! (i, f, g, o) [B, 4H]: sigmoid on i, f, o and tanh on g;
//! state (h | c) [B, 2H]: c' = f c + i g, h' = o tanh(c').
//! ```

use crate::autograd::Real;
use crate::autograd::kernels::vectorised;

/// The functions of the gates, in place.
pub(super) fn activate<T: Real>(gates: &mut [T], n: usize) {
    for row in gates.chunks_exact_mut(4 * n) {
        T::sigmoid_slice(&mut row[..2 * n]);
        T::tanh_slice(&mut row[2 * n..3 * n]);
        T::sigmoid_slice(&mut row[3 * n..]);
    }
}

/// The new state `y [B, 2H]` of `before` by the gates after their functions.
pub(super) fn advance<T: Real>(gates: &[T], before: &[T], y: &mut [T], n: usize) {
    let rows = gates.chunks_exact(4 * n).zip(before.chunks_exact(2 * n));
    for ((gates, before), y) in rows.zip(y.chunks_exact_mut(2 * n)) {
        let c = &before[n..];
        let (h_new, c_new) = y.split_at_mut(n);
        for j in 0..n {
            c_new[j] = gates[n + j] * c[j] + gates[j] * gates[2 * n + j];
        }
        h_new.copy_from_slice(c_new);
        T::tanh_slice(h_new);
        for j in 0..n {
            h_new[j] *= gates[3 * n + j];
        }
    }
}

/// What the gates were and made.
pub(super) struct Advanced<'v, T> {
    pub(super) gates: &'v [T],
    pub(super) before: &'v [T],
    pub(super) after: &'v [T],
}

/// dgates `[B, 4H]` before their functions; `dy [B, 2H]` becomes dc of the state before in its
/// second half. `tanh_c [B, H]` is scratch.
pub(super) fn gates_gradient<T: Real>(
    Advanced {
        gates,
        before,
        after,
    }: Advanced<'_, T>,
    dy: &mut [T],
    dgates: &mut [T],
    tanh_c: &mut [T],
    n: usize,
) {
    for (tanh_c, after) in tanh_c.chunks_exact_mut(n).zip(after.chunks_exact(2 * n)) {
        tanh_c.copy_from_slice(&after[n..]);
    }
    T::tanh_slice(tanh_c);
    let (one, batch) = (T::one(), gates.len() / (4 * n));
    vectorised(
        #[inline(always)]
        || {
            for b in 0..batch {
                let (dh, dc) = dy[b * 2 * n..(b + 1) * 2 * n].split_at_mut(n);
                let gates = &gates[b * 4 * n..(b + 1) * 4 * n];
                let (i, rest) = gates.split_at(n);
                let (f, rest) = rest.split_at(n);
                let (g, o) = rest.split_at(n);
                let dgates = &mut dgates[b * 4 * n..(b + 1) * 4 * n];
                let (di, rest) = dgates.split_at_mut(n);
                let (df, rest) = rest.split_at_mut(n);
                let (dg, d_o) = rest.split_at_mut(n);
                let c = &before[b * 2 * n + n..(b + 1) * 2 * n];
                let tanh_c = &tanh_c[b * n..(b + 1) * n];
                for j in 0..n {
                    let dc_new = dc[j] + dh[j] * o[j] * (one - tanh_c[j] * tanh_c[j]);
                    di[j] = dc_new * g[j] * i[j] * (one - i[j]);
                    df[j] = dc_new * c[j] * f[j] * (one - f[j]);
                    dg[j] = dc_new * i[j] * (one - g[j] * g[j]);
                    d_o[j] = dh[j] * tanh_c[j] * o[j] * (one - o[j]);
                    dc[j] = dc_new * f[j];
                }
            }
        },
    );
}

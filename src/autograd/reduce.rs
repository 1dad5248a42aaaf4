//! Sums that a compiler can vectorise: sixteen partial sums, added up in a fixed order.

use super::kernels::Real;

const LANES: usize = 16;

/// Sum of `f(i)` for i below `len`; `f` must be cheap and inlined.
#[inline(always)]
pub(super) fn sum_with<T: Real>(len: usize, f: impl Fn(usize) -> T) -> T {
    let mut lanes = [T::zero(); LANES];
    let whole = len - len % LANES;
    let mut start = 0;
    while start < whole {
        for (lane, partial) in lanes.iter_mut().enumerate() {
            *partial += f(start + lane);
        }
        start += LANES;
    }
    let mut total = T::zero();
    for i in whole..len {
        total += f(i);
    }
    for partial in lanes {
        total += partial;
    }
    total
}

//! Dropout masks from a counter-based generator: made again wherever they are needed, never stored.

use super::{Real, vectorised};

/// The mask of one dropout: for each index, whether it is kept, as a pure function of a key.
///
/// An element is kept with probability 1 - p, p rounded to a multiple of 2^-16. The same bits on
/// every CPU.
pub(super) struct Dropout {
    first: u32,
    second: u32,
    threshold: u32,
    scale: f64,
}

impl Dropout {
    /// The mask of stream `key` that drops with probability `p` in 0 to 1.
    pub(super) fn new(key: u64, p: f64) -> Self {
        // SplitMix64's output function, so that neighbouring keys give unrelated masks.
        let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        Self {
            first: z as u32,
            second: (z >> 32) as u32,
            threshold: (p * 65_536.0).round() as u32,
            scale: if p < 1.0 { 1.0 / (1.0 - p) } else { 0.0 },
        }
    }

    /// Whether element `index` is kept.
    #[inline(always)]
    pub(super) fn keep(&self, index: u32) -> bool {
        // The hash "lowbias32" with the key's halves mixed in.
        let mut h = index ^ self.first;
        h = (h ^ (h >> 16)).wrapping_mul(0x7feb_352d) ^ self.second;
        h = (h ^ (h >> 15)).wrapping_mul(0x846c_a68b);
        (h >> 16) >= self.threshold
    }
}

/// `out[i] = x[i] * mask[i] / (1 - p)` with the mask of stream `key` (as Dropout makes it).
///
/// # Panics
/// When the lengths differ or exceed 2^32.
#[track_caller]
pub fn dropout_into<T: Real>(key: u64, p: f64, x: &[T], out: &mut [T]) {
    assert_eq!(
        x.len(),
        out.len(),
        "dropout from and into slices of unlike lengths"
    );
    assert!(
        x.len() as u64 <= 1 << 32,
        "a dropout mask has at most 2^32 elements"
    );
    let mask = Dropout::new(key, p);
    let scale = T::from_f64(mask.scale);
    vectorised(
        #[inline(always)]
        || {
            for (i, (out, x)) in out.iter_mut().zip(x).enumerate() {
                let factor = if mask.keep(i as u32) {
                    scale
                } else {
                    T::zero()
                };
                *out = *x * factor;
            }
        },
    );
}

/// [`dropout_into`] with a stream's key and probability, or a copy where there is no dropout.
///
/// # Panics
/// As [`dropout_into`].
#[track_caller]
pub fn dropped_into<T: Real>(dropout: Option<(u64, f64)>, x: &[T], out: &mut [T]) {
    match dropout {
        Some((key, p)) => dropout_into(key, p, x, out),
        None => out.copy_from_slice(x),
    }
}

/// Dropout of a part of its elements where they are, those from `first` on; none changes nothing.
///
/// # Panics
/// When the part reaches beyond 2^32 elements.
#[track_caller]
pub fn drop_in_place<T: Real>(dropout: Option<(u64, f64)>, first: usize, x: &mut [T]) {
    let Some((key, p)) = dropout else { return };
    assert!(
        (first + x.len()) as u64 <= 1 << 32,
        "a dropout mask has at most 2^32 elements"
    );
    let mask = Dropout::new(key, p);
    let scale = T::from_f64(mask.scale);
    vectorised(
        #[inline(always)]
        || {
            for (i, x) in x.iter_mut().enumerate() {
                let kept = mask.keep((first + i) as u32);
                *x *= if kept { scale } else { T::zero() };
            }
        },
    );
}

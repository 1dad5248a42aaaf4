//! The choice of an instruction set, made once at run time.

use std::sync::OnceLock;

/// An instruction set that kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// AVX-512 (F, BW, DQ, VL) with FMA.
    Avx512,
    /// AVX2 with FMA.
    Avx2,
    /// Whatever the crate was compiled for.
    Portable,
}

impl Isa {
    /// The best set this CPU has.
    #[inline]
    pub fn detected() -> Self {
        static DETECTED: OnceLock<Isa> = OnceLock::new();
        *DETECTED.get_or_init(|| Self::available()[0])
    }

    /// Every set this CPU has, best first; the last one is [`Isa::Portable`].
    pub fn available() -> Vec<Self> {
        let mut sets = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            let avx512 = is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512bw")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl");
            if avx2 && avx512 {
                sets.push(Self::Avx512);
            }
            if avx2 {
                sets.push(Self::Avx2);
            }
        }
        sets.push(Self::Portable);
        sets
    }

    /// Panics unless this CPU has the set.
    #[track_caller]
    pub(super) fn require(self) {
        assert!(Self::available().contains(&self), "this CPU lacks {self:?}");
    }
}

/// Runs `f` compiled for the best instruction set of the CPU, so that plain loops in it vectorise.
///
/// `f` is compiled once for each [`Isa`]. What it calls must be inlined into it to profit: write
/// `vectorised(#[inline(always)] || ...)` and mark the functions it calls `#[inline(always)]`.
/// Results do not depend on the set: the compiler neither reorders nor fuses float operations.
#[inline]
pub fn vectorised<R>(f: impl FnOnce() -> R) -> R {
    match Isa::detected() {
        // SAFETY: `detected` returned a set this CPU has.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx512 => unsafe { with_avx512(f) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Isa::Avx2 => unsafe { with_avx2(f) },
        _ => f(),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512bw,avx512dq,avx512vl,avx2,fma")]
fn with_avx512<R>(f: impl FnOnce() -> R) -> R {
    f()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
fn with_avx2<R>(f: impl FnOnce() -> R) -> R {
    f()
}
